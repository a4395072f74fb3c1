#include <algorithm>
#include <functional>
#include <gmock/gmock.h>
#include <rapidcheck.h>
#include <variant>

#include "firmware/latch/latch.hpp"
#include "rig.hpp"

namespace probebox::latch_test {
namespace {

using namespace latch;

LatchConfig lossConfig() {
  LatchConfig config{.samples_per_tick = 2};
  config.probe.interval = Nanoseconds{250'000};
  for (SourceConfig& axis : config.axes) axis.interval = Nanoseconds{500'000};
  config.maximum_wait = Nanoseconds{20'000'000};
  return config;
}

// One delivered thing: an event, or the clock's new map.
struct Delivery {
  std::int64_t arrives_ns{};
  std::variant<Event, TickMap> what;
};

// Outages are [from, to) in ns after the start.
struct Outage {
  std::int64_t from{};
  std::int64_t to{};
  bool contains(std::int64_t ns) const { return ns >= kStartNs + from && ns < kStartNs + to; }
};

std::vector<Delivery> deliveries(std::int64_t ticks, const Outage& probe, const Outage& encoders, const Outage& clock,
                                 const std::function<std::int64_t()>& latency) {
  std::vector<Delivery> all;
  const std::int64_t end = kStartNs + ticks * kPeriodNs;
  for (std::int64_t ns = kStartNs; ns < end; ns += 250'000) {
    if (!probe.contains(ns)) all.push_back({ns + latency(), Event{deflectionAt(ns)}});
    if (ns % 500'000 == 0) {
      for (const Axis axis : {Axis::x, Axis::y, Axis::z}) {
        if (axis != Axis::y || !encoders.contains(ns)) all.push_back({ns + latency(), Event{countAt(axis, ns)}});
      }
    }
    if (ns % kPeriodNs == 0) {
      const ClockState state = clock.contains(ns) ? ClockState::ambiguous : ClockState::locked;
      all.push_back({ns + 500'000, perfectMap((ns - kStartNs) / kPeriodNs, state)});
      all.push_back({ns + 1, Event{TimeAdvanced{monoTime(ns)}}});
    }
  }
  std::stable_sort(all.begin(), all.end(), [](const auto& a, const auto& b) { return a.arrives_ns < b.arrives_ns; });
  return all;
}

void deliver(Latch& latch, Harvest& harvest, const std::vector<Delivery>& all) {
  for (const Delivery& delivery : all) {
    if (const auto* event = std::get_if<Event>(&delivery.what)) {
      latch.push(*event);
    } else {
      latch.setClock(std::get<TickMap>(delivery.what));
    }
    harvest.take(latch);
  }
}

Harvest harvestOf(std::int64_t ticks, const Outage& probe, const Outage& encoders, const Outage& clock) {
  Latch latch{lossConfig()};
  Harvest harvest;
  deliver(latch, harvest, deliveries(ticks, probe, encoders, clock, [] { return std::int64_t{1000}; }));
  return harvest;
}

constexpr std::int64_t kMs = 1'000'000;

TEST(Loss, OfTheProbeIsDeclaredWithItsCount) {
  const Harvest harvest = harvestOf(200, {50 * kMs, 60 * kMs}, {}, {});
  EXPECT_TRUE(harvest.contiguous);
  EXPECT_EQ(harvest.lostFor(LostReason::probe), 20);  // 50.0 to 59.5 ms
  EXPECT_EQ(harvest.losses.size(), 1U);
}

TEST(Loss, OfOneEncoderIsDeclaredAsSuch) {
  const Harvest harvest = harvestOf(200, {}, {50 * kMs, 60 * kMs}, {});
  EXPECT_TRUE(harvest.contiguous);
  EXPECT_EQ(harvest.lostFor(LostReason::encoders), 20);
  EXPECT_EQ(harvest.lostFor(LostReason::probe), 0);
}

TEST(Loss, OutagesLongerThanTheMaximumWaitAreDeclaredWhileTheyLast) {
  Latch latch{lossConfig()};
  Harvest harvest;
  deliver(latch, harvest, deliveries(200, {50 * kMs, 500 * kMs}, {}, {}, [] { return std::int64_t{1000}; }));
  EXPECT_TRUE(harvest.contiguous);
  EXPECT_NEAR(static_cast<double>(harvest.lostFor(LostReason::probe)), 2 * (200 - 50 - 20), 4);
}

TEST(Loss, OfTheClockIsDeclaredInOnePieceWhenItComesBack) {
  const Harvest harvest = harvestOf(200, {}, {}, {100 * kMs, 150 * kMs});
  EXPECT_TRUE(harvest.contiguous);
  ASSERT_EQ(harvest.losses.size(), 1U);
  EXPECT_EQ(harvest.losses[0].reason, LostReason::clock);
  EXPECT_NEAR(static_cast<double>(harvest.losses[0].count), 2 * 51, 4);
}

TEST(Loss, AGapUpToTwoAndAHalfIntervalsIsBridgedAndNoLongerOne) {
  for (const auto& [missing_deflections, expected_lost] : {std::pair{1, 0}, std::pair{2, 1}}) {
    const Harvest harvest =
        harvestOf(200, {50 * kMs + 250'000, 50 * kMs + 250'000 * (1 + missing_deflections)}, {}, {});
    EXPECT_EQ(harvest.lostFor(LostReason::probe), expected_lost) << missing_deflections;
  }
}

TEST(Loss, NothingIsExtrapolatedBeforeTheFirstStamp) {
  const Harvest harvest = harvestOf(100, {0, 10 * kMs}, {}, {});
  EXPECT_TRUE(harvest.contiguous);
  EXPECT_EQ(harvest.lostFor(LostReason::probe), 18);  // 1.0 to 9.5 ms
  EXPECT_EQ(harvest.losses.front().first.index, 2);
}

TEST(Loss, EventsAfterTheirSampleAreCountedLate) {
  Latch latch{lossConfig()};
  Harvest harvest;
  deliver(latch, harvest, deliveries(100, {50 * kMs, 500 * kMs}, {}, {}, [] { return std::int64_t{1000}; }));
  EXPECT_EQ(latch.counters().late, 0U);
  latch.push(deflectionAt(kStartNs + 51 * kMs));
  EXPECT_EQ(latch.counters().late, 1U);
  latch.push(deflectionAt(kStartNs + 51 * kMs));
  EXPECT_EQ(latch.counters().disordered, 1U);
}

// Whatever drops out, whatever comes late or in whatever order between the sources: every index is decided once, every
// record is the truth at its time, and the counters add up.
TEST(Loss, ProducedIsRecordsPlusLostUnderAnyFaults) {
  const bool holds = rc::check("produced == records + lost", [] {
    const auto outage = [] {
      const auto from = *rc::gen::inRange<std::int64_t>(0, 150 * kMs);
      return Outage{from, from + *rc::gen::inRange<std::int64_t>(0, 100 * kMs)};
    };
    const Outage probe = outage();
    const Outage encoders = outage();
    const Outage clock = outage();
    std::uint64_t noise = *rc::gen::arbitrary<std::uint64_t>() | 1;
    const auto longest_ns = *rc::gen::inRange<std::int64_t>(1, 30 * kMs);
    const auto latency = [&] {
      noise = noise * 6364136223846793005U + 1442695040888963407U;
      return static_cast<std::int64_t>(noise >> 33) % longest_ns;
    };
    Latch latch{lossConfig()};
    Harvest harvest;
    deliver(latch, harvest, deliveries(250, probe, encoders, clock, latency));
    RC_ASSERT(harvest.contiguous);
    for (const Record& record : harvest.records) {
      const std::int64_t ns = kStartNs + record.index.index * kPeriodNs / 2;
      for (std::size_t i = 0; i < 3; ++i) {
        RC_ASSERT(std::abs(record.values[i] - rampNm(i, ns)) <= 2);
        RC_ASSERT(std::abs(record.values[3 + i] - rampCounts(i, ns)) <= 2);
      }
    }
  });
  EXPECT_TRUE(holds);
}

}  // namespace
}  // namespace probebox::latch_test
