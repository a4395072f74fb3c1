#include <array>
#include <cmath>
#include <gmock/gmock.h>
#include <memory>
#include <random>
#include <vector>

#include "drivers/counter/counter_source.hpp"
#include "drivers/counter/emulator.hpp"
#include "drivers/io/summed_source.hpp"
#include "host-tests/support/events_of.hpp"
#include "host-tests/support/no_alloc.hpp"

// A secondary axis is added to its primary axis: a quill in a slide, each with a counter of its own.
namespace probebox::counter {
namespace {

using namespace std::chrono_literals;

constexpr double kCountsPerCount = -2.5;       // the quill's encoder counts down, and its counts are larger
constexpr std::size_t kSlide = 2, kQuill = 8;  // Z and W

class QuillInASlide : public ::testing::Test {
 protected:
  QuillInASlide() {
    auto slide = counterOf(kSlide, [this](double t_s) { return slideAt(t_s); });
    devices[0] = slide.get();
    auto quill = counterOf(kQuill, [this](double t_s) { return quillAt(t_s); });
    devices[1] = quill.get();
    source = std::make_unique<io::SummedSource>(sourceOf(std::move(slide), kSlide), sourceOf(std::move(quill), kQuill),
                                                kCountsPerCount);
  }

  template <class Counts>
  std::unique_ptr<EmulatedCounter> counterOf(std::size_t axis, Counts counts) {
    return std::make_unique<EmulatedCounter>(
        EmulatedCounter::Config{.interval = intervalOf(axis)},
        [this, counts](MonoTime at) { return std::llround(counts(toSeconds(at - begin))); });
  }
  static std::unique_ptr<CounterSource> sourceOf(std::unique_ptr<EmulatedCounter> port, std::size_t axis) {
    return std::make_unique<CounterSource>(
        std::move(port), CounterConfig{.axis = axis, .device = "counter0", .interval = intervalOf(axis)});
  }
  static Nanoseconds intervalOf(std::size_t axis) { return axis == kQuill ? 3ms : 1ms; }
  void run(Nanoseconds duration) {
    for (const MonoTime end = now + duration; now < end;) {
      now += 1ms;
      std::array<Event, 5> batch;
      while (const std::size_t count = source->read(batch, now))
        events.insert(events.end(), batch.begin(), batch.begin() + static_cast<std::ptrdiff_t>(count));
    }
  }
  double slideAt(double t_s) const { return 1e5 * t_s; }
  double quillAt(double t_s) const { return 2e4 * std::sin(5 * t_s); }

  const MonoTime begin{monoTime(7'000'000'000)};
  MonoTime now{begin};
  std::array<EmulatedCounter*, 2> devices{};
  std::unique_ptr<io::SummedSource> source;
  std::vector<Event> events;
};

TEST_F(QuillInASlide, IsWhereBothTogetherAre) {
  run(2s);
  const auto counts = support::eventsOf<Count>(events);
  ASSERT_GT(counts.size(), 1900U);
  std::uint32_t next = counts.front().sequence;
  for (const auto& count : counts) {
    EXPECT_EQ(count.axis, Axis::z);
    EXPECT_EQ(count.sequence, next++) << "no count is left out";
    const double t_s = toSeconds(count.at - begin);
    // Interpolated over 3 ms, and rounded: the counts of the quill, and then those of the slide.
    EXPECT_NEAR(static_cast<double>(count.counts), slideAt(t_s) + kCountsPerCount * quillAt(t_s), 4) << t_s;
  }
}

TEST_F(QuillInASlide, NamesBoth) {
  EXPECT_EQ(source->name(), "encoder Z on counter0 + encoder W on counter0");
  run(10ms);
  devices[1]->unplug();
  run(10ms);
  EXPECT_THAT(std::string{source->problem()}, ::testing::HasSubstr("counter0 disappeared"));
}

TEST_F(QuillInASlide, IsLostWithEitherAndComesBackWithBoth) {
  for (auto* const device : devices) {
    run(100ms);
    device->unplug();
    events.clear();
    run(500ms);
    const auto lost = support::eventsOf<SourceLost>(events);
    ASSERT_EQ(lost.size(), 1U);
    EXPECT_TRUE(lost.front().concerns(Axis::z));
    EXPECT_LT(support::eventsOf<Count>(events).size(), 5U) << "what was on its way";
    device->plugIn(now);
    events.clear();
    run(2s);
    EXPECT_GT(support::eventsOf<Count>(events).size(), 500U);
  }
}

TEST_F(QuillInASlide, AllocatesNothingOnTheWay) {
  run(100ms);
  std::array<Event, 64> batch;
  const support::NoAlloc none;
  for (int k = 0; k < 100; ++k) {
    now += 1ms;
    while (source->read(batch, now) > 0) continue;
  }
}

Count at(std::uint32_t sequence, std::int64_t counts, std::int64_t at_us) {
  return {.axis = Axis::x, .sequence = sequence, .counts = counts, .at = monoTime(1000 * at_us)};
}

TEST(SummedCounts, AddsLatchesOfOneEdgeExactly) {
  io::SummedCounts sums{1};
  sums.pushPrimary(at(1, 100, 10));
  EXPECT_FALSE(sums.next()) << "the other may still come";
  sums.pushSecondary(at(9, 7, 10));
  const auto sum = sums.next();
  ASSERT_TRUE(sum);
  EXPECT_EQ(sum->counts, 107);
  EXPECT_EQ(sum->sequence, 1U);
  EXPECT_FALSE(sums.next());
}

TEST(SummedCounts, LeavesOutWhatTheSecondaryAxisSaysNothingAbout) {
  io::SummedCounts sums{1};
  sums.pushPrimary(at(1, 100, 10));  // before its first count
  for (const std::int64_t us : {25, 55, 75}) sums.pushPrimary(at(static_cast<std::uint32_t>(us), 100, us));
  sums.pushSecondary(at(1, 20, 20));
  sums.pushSecondary(at(2, 40, 40));
  sums.pushSecondary(at(4, 70, 70));  // one was lost before it
  sums.pushSecondary(at(5, 80, 80));
  ASSERT_EQ(sums.next()->counts, 125);
  ASSERT_EQ(sums.next()->counts, 175);
  EXPECT_FALSE(sums.next());
}

TEST(SummedCounts, WaitsForNothingAfterARestart) {
  io::SummedCounts sums{1};
  sums.pushSecondary(at(1, 20, 20));
  sums.pushPrimary(at(1, 100, 30));
  sums.restart();
  sums.pushSecondary(at(2, 40, 40));
  EXPECT_FALSE(sums.next());
}

}  // namespace
}  // namespace probebox::counter
