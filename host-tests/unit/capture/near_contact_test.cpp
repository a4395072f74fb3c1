#include "firmware/capture/near_contact.hpp"

#include <algorithm>
#include <gtest/gtest.h>

#include "firmware/capture/touch_capture.hpp"
#include "locked_clock.hpp"

namespace probebox::capture {
namespace {

constexpr TouchRequest kSlowTouch{
    .step = 1, .outward_normal = {1, 0, 0}, .retract_direction = {1, 0, 0}, .retract_speed_mm_s = 5};
constexpr std::int64_t kStep_ms = 1600;

MonoTime ms(std::int64_t at) {
  return monoTime(at * 1'000'000);
}

// Deflection, nm, of 0.3 mm at 5 mm/s in each direction: contact at 500 ms, at rest from 560 to 700, free at 760.
std::int32_t deflection_nm(std::int64_t at_ms) {
  return static_cast<std::int32_t>(5000 * std::clamp<std::int64_t>(std::min(at_ms - 500, 760 - at_ms), 0, 60));
}

class OneTouch {
 public:
  explicit OneTouch(Capacity capacity = {}) : capture_{capacity} {}

  // One row of each stream a millisecond; the machine's say when. The probe's rows are those that `arrives`.
  template <class Channel, class Arrives>
  TouchFault record(const TouchRequest& request, const Channel& channel_nm, const Arrives& arrives) {
    capture_.begin(request);
    for (std::int64_t at = 0; at < kStep_ms; ++at) {
      for (const Axis axis : {Axis::x, Axis::y, Axis::z}) capture_.push(Count{axis, 0, at, ms(at)});
      if (arrives(at)) capture_.push(Deflection{0, {channel_nm(at), 0, 0}, false, ms(at)});
      if (request.by_edges && (at == 500 || at == 760))
        capture_.push(Edge{LineRole::trigger, 0, at == 500 ? Level::active : Level::inactive, 0, ms(at)});
    }
    return capture_.end(kLocked);
  }
  template <class Channel>
  TouchFault record(const TouchRequest& request, const Channel& channel_nm) {
    return record(request, channel_nm, [](std::int64_t) { return true; });
  }
  const Recording& recording() const { return capture_.recording(); }
  const Touch& newest() const { return recording().touches().back(); }
  void expectKept(std::int64_t from_ms, std::int64_t until_ms) const {
    const auto machine = recording().machineRows(newest());
    EXPECT_EQ(machine.front().at, ms(from_ms));
    EXPECT_EQ(machine.back().at, ms(until_ms));
    EXPECT_EQ(machine.size(), static_cast<std::size_t>(until_ms - from_ms + 1)) << "all of them in between";
    for (const auto& row : machine) EXPECT_EQ(ms(row.counts[0]), row.at);
    if (newest().request.by_edges) return;
    const auto probe = recording().probeRows(newest());
    EXPECT_EQ(probe.size(), machine.size());
    EXPECT_EQ(probe.front().at, ms(from_ms));
    EXPECT_EQ(probe.back().at, ms(until_ms));
  }

 private:
  TouchCapture capture_;
};

TEST(NearContact, KeepsOfATouchTheFreeProbeBeforeItAndThreeOvertravelsAfter) {
  OneTouch touch;
  ASSERT_EQ(touch.record(kSlowTouch, deflection_nm), TouchFault::none);
  // 5 um are reached 1 ms after contact, and half of the deflection is left 30 ms before its end.
  touch.expectKept(401, 759 + 2 * 2 * 29 + 100);
}

TEST(NearContact, KeepsAllWhereNoContactStandsOut) {
  OneTouch touch;
  ASSERT_EQ(touch.record(kSlowTouch, [](std::int64_t at) { return static_cast<std::int32_t>(at % 3 * 1000); }),
            TouchFault::none);
  touch.expectKept(0, kStep_ms - 1);
  // A probe that is not zero when it is free.
  ASSERT_EQ(touch.record(kSlowTouch, [](std::int64_t at) { return deflection_nm(at) + 50'000; }), TouchFault::none);
  touch.expectKept(0, kStep_ms - 1);
}

TEST(NearContact, KeepsTheWayAboutBothEdges) {
  OneTouch touch;
  auto by_edges = kSlowTouch;
  by_edges.by_edges = true;
  ASSERT_EQ(touch.record(by_edges, [](std::int64_t) { return 0; }), TouchFault::none);
  touch.expectKept(500 - 40 - 100, 760 + 40 + 100);  // 0.2 mm at 5 mm/s
}

TEST(NearContact, KeepsAllOfAHoldAndOfATouchThatEndsEarly) {
  OneTouch touch;
  auto hold = kSlowTouch;
  hold.holds = true;
  hold.head_range_mm = 1;
  ASSERT_EQ(touch.record(hold, deflection_nm), TouchFault::none);
  touch.expectKept(0, kStep_ms - 1);
  ASSERT_EQ(touch.record(kSlowTouch, [](std::int64_t at) { return deflection_nm(std::min<std::int64_t>(at, 650)); }),
            TouchFault::none);
  touch.expectKept(401, kStep_ms - 1);
}

TEST(NearContact, KeepsRowsOfTheFreeProbeOnBothSidesOfAHole) {
  OneTouch touch;
  // The probe is seen again when it is fully deflected, or when it has long been free.
  ASSERT_EQ(touch.record(kSlowTouch, deflection_nm, [](std::int64_t at) { return at < 400 || at > 600; }),
            TouchFault::none);
  EXPECT_EQ(touch.recording().probeRows(touch.newest()).front().at, ms(395));
  EXPECT_EQ(touch.recording().machineRows(touch.newest()).front().at, ms(395));
  ASSERT_EQ(touch.record(kSlowTouch, deflection_nm, [](std::int64_t at) { return at < 650 || at > 1200; }),
            TouchFault::none);
  EXPECT_EQ(touch.recording().probeRows(touch.newest()).back().at, ms(1205));
  EXPECT_EQ(touch.recording().machineRows(touch.newest()).back().at, ms(1205));
}

TEST(NearContact, KeepsRowsOfTheFreeProbeInASlowStream) {
  OneTouch touch;
  ASSERT_EQ(touch.record(kSlowTouch, deflection_nm, [](std::int64_t at) { return at % 60 == 0; }), TouchFault::none);
  EXPECT_EQ(touch.recording().probeRows(touch.newest()).front().at, ms(240));  // contact from 540 to 720
  EXPECT_EQ(touch.recording().probeRows(touch.newest()).back().at, ms(1020));
}

TEST(NearContact, LetsManyTouchesIntoARecording) {
  OneTouch touch{{.machine_rows = 10'000, .probe_rows = 10'000, .touches = 20}};
  for (int count = 0; count < 14; ++count)
    ASSERT_EQ(touch.record(kSlowTouch, deflection_nm), TouchFault::none) << count;
  EXPECT_EQ(touch.recording().touches().size(), 14U);
  for (const auto& one : touch.recording().touches()) {
    EXPECT_EQ(touch.recording().machineRows(one).size(), touch.recording().probeRows(one).size());
    EXPECT_EQ(touch.recording().machineRows(one).front().at, ms(401));
  }
}

}  // namespace
}  // namespace probebox::capture
