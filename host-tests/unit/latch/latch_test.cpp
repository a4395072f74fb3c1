#include "firmware/latch/latch.hpp"

#include <gmock/gmock.h>

#include "host-tests/support/no_alloc.hpp"
#include "rig.hpp"

namespace probebox::latch_test {
namespace {

using namespace latch;

// Feeds all sources, each at its own rate and phase, from `from` to `to` ns.
void feed(Latch& latch, Harvest& harvest, std::int64_t from, std::int64_t to, ClockState state = ClockState::locked) {
  for (std::int64_t ns = from; ns < to; ns += 50'000) {
    if (ns % 250'000 == 0) latch.push(deflectionAt(ns + 13'000));
    if (ns % 500'000 == 0) {
      for (const Axis axis : {Axis::x, Axis::y, Axis::z})
        latch.push(countAt(axis, ns + 31'000 * static_cast<std::int64_t>(axis)));
    }
    if (ns % kPeriodNs == 0) latch.setClock(perfectMap((ns - kStartNs) / kPeriodNs, state));
    harvest.take(latch);
  }
}

LatchConfig rigConfig(std::int32_t samples_per_tick = 4) {
  LatchConfig config{.samples_per_tick = samples_per_tick};
  config.probe.interval = Nanoseconds{250'000};
  for (SourceConfig& axis : config.axes) axis.interval = Nanoseconds{500'000};
  return config;
}

std::int64_t sampleNs(SampleIndex sample, std::int32_t samples_per_tick) {
  return kStartNs + sample.index * kPeriodNs / samples_per_tick;
}

TEST(Latch, GivesOneRecordASampleWithEverySourceAtTheSampleTime) {
  for (const std::int32_t per_tick : {1, 4, 10, 100}) {
    Latch latch{rigConfig(per_tick)};
    Harvest harvest;
    feed(latch, harvest, kStartNs, kStartNs + 200 * kPeriodNs);
    EXPECT_TRUE(harvest.contiguous);
    EXPECT_TRUE(harvest.losses.empty());
    ASSERT_GT(harvest.records.size(), 190U * static_cast<std::size_t>(per_tick));
    EXPECT_EQ(harvest.records.front().index.index, per_tick);  // the tick after the lock
    for (const Record& record : harvest.records) {
      const std::int64_t ns = sampleNs(record.index, per_tick);
      for (std::size_t i = 0; i < 3; ++i) {
        EXPECT_NEAR(static_cast<double>(record.values[i]), static_cast<double>(rampNm(i, ns)), 2);
        EXPECT_NEAR(static_cast<double>(record.values[3 + i]), static_cast<double>(rampCounts(i, ns)), 2);
      }
      EXPECT_EQ(record[Channel::flags], 0);
    }
  }
}

TEST(Latch, MovesAStaleAxisBackByItsDelay) {
  LatchConfig config = rigConfig();
  config.tau = {Nanoseconds{3'850'000}, Nanoseconds{0}, Nanoseconds{-400'000}};
  Latch latch{config};
  Harvest harvest;
  feed(latch, harvest, kStartNs, kStartNs + 100 * kPeriodNs);
  EXPECT_TRUE(harvest.contiguous);
  ASSERT_GT(harvest.records.size(), 300U);
  for (const Record& record : harvest.records) {
    const std::int64_t ns = sampleNs(record.index, 4);
    EXPECT_NEAR(static_cast<double>(record[Channel::d1]), static_cast<double>(rampNm(0, ns)), 2);
    EXPECT_NEAR(static_cast<double>(record[Channel::x]), static_cast<double>(rampCounts(0, ns + 3'850'000)), 2);
    EXPECT_NEAR(static_cast<double>(record[Channel::y]), static_cast<double>(rampCounts(1, ns)), 2);
  }
}

TEST(Latch, TakesANewDelayForTheSamplesThatAreNotDecidedYet) {
  for (const std::int64_t tau_ns : {3'850'000, -400'000}) {
    Latch latch{rigConfig()};
    Harvest harvest;
    feed(latch, harvest, kStartNs, kStartNs + 100 * kPeriodNs);
    const auto decided = harvest.records.size();
    ASSERT_TRUE(latch.setTau({Nanoseconds{tau_ns}, Nanoseconds{0}, Nanoseconds{0}}));
    feed(latch, harvest, kStartNs + 100 * kPeriodNs, kStartNs + 200 * kPeriodNs);
    EXPECT_TRUE(harvest.contiguous);
    ASSERT_GT(harvest.records.size(), decided + 300);
    for (std::size_t i = 0; i < harvest.records.size(); ++i) {
      const Record& record = harvest.records[i];
      const std::int64_t ns = sampleNs(record.index, 4) + (i < decided ? 0 : tau_ns);
      EXPECT_NEAR(static_cast<double>(record[Channel::x]), static_cast<double>(rampCounts(0, ns)), 2) << i;
    }
    EXPECT_EQ(latch.counters().disordered, 0U);
    EXPECT_FALSE(latch.setTau({Nanoseconds{3'000'000'000}, {}, {}})) << "no buffer spans that";
  }
}

TEST(Latch, WaitsForTheSlowestSourceAndNoLonger) {
  Latch latch{rigConfig(1)};
  latch.setClock(perfectMap(0));
  Harvest harvest;
  const std::int64_t sample = kStartNs + kPeriodNs;
  for (const std::int64_t ns : {sample - 100'000, sample + 100'000}) {
    latch.push(deflectionAt(ns));
    latch.push(countAt(Axis::x, ns));
    latch.push(countAt(Axis::y, ns));
    harvest.take(latch);
  }
  latch.push(countAt(Axis::z, sample - 100'000));
  harvest.take(latch);
  EXPECT_TRUE(harvest.records.empty());
  latch.push(countAt(Axis::z, sample));
  harvest.take(latch);
  ASSERT_EQ(harvest.records.size(), 1U);
  EXPECT_EQ(harvest.records[0][Channel::z], rampCounts(2, sample));
}

TEST(Latch, SourcesThatAreNotFittedAreZeroAndNotWaitedFor) {
  LatchConfig config = rigConfig(1);
  for (SourceConfig& axis : config.axes) axis.interval = Nanoseconds{0};
  Latch latch{config};
  Harvest harvest;
  for (std::int64_t tick = 0; tick < 20; ++tick) {
    latch.setClock(perfectMap(tick));
    for (int i = 0; i < 4; ++i) latch.push(deflectionAt(kStartNs + tick * kPeriodNs + i * 250'000));
    harvest.take(latch);
  }
  ASSERT_EQ(harvest.records.size(), 19U);
  EXPECT_EQ(harvest.records[5][Channel::x], 0);
  EXPECT_NE(harvest.records[5][Channel::d1], 0);
}

TEST(Latch, CubicFollowsACurveThatLinearCuts) {
  const auto worst = [](Interpolation interpolation) {
    LatchConfig config = rigConfig(4);
    config.probe.interval = Nanoseconds{0};
    for (SourceConfig& axis : config.axes) axis = {Nanoseconds{1'000'000}, interpolation};
    config.axes[1].interval = config.axes[2].interval = Nanoseconds{0};
    Latch latch{config};
    Harvest harvest;
    const auto curve = [](std::int64_t ns) { return 1e6 * std::sin(1e-9 * 30 * static_cast<double>(ns - kStartNs)); };
    for (std::int64_t tick = 0; tick < 300; ++tick) {
      const std::int64_t ns = kStartNs + tick * kPeriodNs;
      latch.setClock(perfectMap(tick));
      latch.push(Count{.axis = Axis::x, .sequence = 0, .counts = std::llround(curve(ns)), .at = monoTime(ns)});
      harvest.take(latch);
    }
    double error = 0;
    for (const Record& record : harvest.records) {
      error = std::max(error, std::abs(static_cast<double>(record[Channel::x]) - curve(sampleNs(record.index, 4))));
    }
    return error;
  };
  EXPECT_GT(worst(Interpolation::linear), 50);
  EXPECT_LT(worst(Interpolation::cubic), 2);
}

TEST(Flags, SayWhatTheLinesAndMarkersSayAtTheSample) {
  Latch latch{rigConfig(1)};
  Harvest harvest;
  const auto at = [](double tick) { return kStartNs + static_cast<std::int64_t>(tick * kPeriodNs); };
  feed(latch, harvest, at(0), at(10));
  latch.push(edgeAt(LineRole::trigger, Level::active, at(10.5)));
  latch.push(edgeAt(LineRole::trigger, Level::inactive, at(12.5)));
  latch.push(edgeAt(LineRole::skip, Level::active, at(13.5)));
  latch.push(edgeAt(LineRole::index, Level::active, at(15.5)));
  latch.push(Marker{.phase = MarkerPhase::begin, .at = monoTime(at(16.5))});
  latch.push(Marker{.phase = MarkerPhase::end, .at = monoTime(at(18.5))});
  feed(latch, harvest, at(10), at(25));
  const auto flags = [&](std::int64_t tick) {
    return harvest.records.at(static_cast<std::size_t>(tick - 1))[Channel::flags];
  };
  EXPECT_EQ(flags(10), 0);
  EXPECT_EQ(flags(11), flag::kTrigger | flag::kTouch);
  EXPECT_EQ(flags(12), flag::kTouch);
  EXPECT_EQ(flags(13), 0);
  EXPECT_EQ(flags(14), flag::kSkip);
  EXPECT_EQ(flags(16), flag::kSkip | flag::kIndexPulse);
  EXPECT_EQ(flags(17), flag::kSkip | flag::kStep);
  EXPECT_EQ(flags(18), flag::kSkip | flag::kStep);
  EXPECT_EQ(flags(19), flag::kSkip);
  EXPECT_EQ(latch.counters().late, 0U);
}

TEST(Flags, ATriggerIsNotForgottenWhereSamplesAreLost) {
  Latch latch{rigConfig(1)};
  Harvest harvest;
  feed(latch, harvest, kStartNs, kStartNs + 10 * kPeriodNs);
  latch.push(edgeAt(LineRole::trigger, Level::active, kStartNs + 12 * kPeriodNs));
  latch.push(edgeAt(LineRole::trigger, Level::inactive, kStartNs + 13 * kPeriodNs));
  feed(latch, harvest, kStartNs + 20 * kPeriodNs, kStartNs + 30 * kPeriodNs);
  const auto after =
      std::find_if(harvest.records.begin(), harvest.records.end(), [](const Record& r) { return r.index.index > 13; });
  ASSERT_NE(after, harvest.records.end());
  EXPECT_EQ((*after)[Channel::flags], flag::kTrigger);
  EXPECT_EQ((*(after + 1))[Channel::flags], 0);
}

TEST(Flags, ALateTriggerComesWithTheNextRecordAndIsCounted) {
  Latch latch{rigConfig(1)};
  Harvest harvest;
  feed(latch, harvest, kStartNs, kStartNs + 20 * kPeriodNs);
  const std::size_t before = harvest.records.size();
  latch.push(edgeAt(LineRole::trigger, Level::active, kStartNs + 3 * kPeriodNs));
  EXPECT_EQ(latch.counters().late, 1U);
  feed(latch, harvest, kStartNs + 20 * kPeriodNs, kStartNs + 25 * kPeriodNs);
  EXPECT_EQ(harvest.records.at(before)[Channel::flags], flag::kTrigger | flag::kTouch);
}

TEST(Flags, ClippedProbeAndHoldoverAreSaid) {
  Latch latch{rigConfig(1)};
  Harvest harvest;
  feed(latch, harvest, kStartNs, kStartNs + 10 * kPeriodNs);
  latch.push(deflectionAt(kStartNs + 10 * kPeriodNs - 100, true));
  feed(latch, harvest, kStartNs + 10 * kPeriodNs, kStartNs + 20 * kPeriodNs, ClockState::holdover);
  const auto flags = [&](std::size_t tick) { return harvest.records.at(tick - 1)[Channel::flags]; };
  EXPECT_EQ(flags(10) & flag::kClipped, flag::kClipped);
  EXPECT_EQ(flags(11) & flag::kClipped, 0);
  EXPECT_EQ(flags(8) & flag::kHoldover, 0);
  EXPECT_EQ(flags(15) & flag::kHoldover, flag::kHoldover);
}

TEST(Latch, IgnoresEventsThatAreNotForIt) {
  Latch latch{rigConfig()};
  for (const Event& event : {Event{Drift{}}, Event{SourceLost{}}, Event{ProcedureStarted{}}, Event{ProcedureAborted{}},
                             Event{Solved{}}, Event{DelayActivated{}}, Event{CountedDeflection{}}}) {
    latch.push(event);
  }
  Harvest harvest;
  feed(latch, harvest, kStartNs, kStartNs + 20 * kPeriodNs);
  EXPECT_GT(harvest.records.size(), 60U);
}

TEST(Latch, NeverAllocatesAfterConstruction) {
  Latch latch{rigConfig(10)};
  const support::NoAlloc guard;
  std::int64_t decisions = 0;
  for (std::int64_t ns = kStartNs; ns < kStartNs + 5000 * kPeriodNs; ns += 250'000) {
    latch.push(deflectionAt(ns));
    for (const Axis axis : {Axis::x, Axis::y, Axis::z}) latch.push(countAt(axis, ns));
    latch.push(edgeAt(LineRole::trigger, Level::active, ns + 1));
    latch.setClock(perfectMap((ns - kStartNs) / kPeriodNs));
    latch.push(Event{TimeAdvanced{monoTime(ns)}});
    while (latch.next()) ++decisions;
  }
  EXPECT_EQ(guard.allocations(), 0U);
  EXPECT_GT(decisions, 49'000);
}

TEST(Config, RefusesWhatCannotWorkByName) {
  EXPECT_FALSE(validate(rigConfig()));
  EXPECT_THAT(validate(rigConfig(0))->what, testing::HasSubstr("samples_per_tick"));
  EXPECT_THAT(validate(rigConfig(101))->what, testing::HasSubstr("samples_per_tick"));
  LatchConfig fast = rigConfig();
  fast.probe.interval = Nanoseconds{900};
  EXPECT_THAT(validate(fast)->what, testing::HasSubstr("probe"));
  LatchConfig slow = rigConfig();
  slow.tau[1] = Nanoseconds{3'000'000'000};
  EXPECT_THAT(validate(slow)->what, testing::HasSubstr("delay"));
}

// At any rate that a probe may have, a sample can wait for the slowest machine.
TEST(Config, TheLongestDelayIsSpannedAtEveryRate) {
  for (const Nanoseconds interval :
       {Nanoseconds{10'000'000}, Nanoseconds{1'000'000}, Nanoseconds{10'000}, Nanoseconds{2'000}}) {
    LatchConfig config = rigConfig();
    config.probe.interval = interval;
    config.probe.interpolation = Interpolation::linear;
    for (auto& axis : config.axes) axis.interval = Nanoseconds{1'000'000};
    config.tau.fill(kLongestDelay);
    ASSERT_FALSE(validate(config));
    Latch latch{config};
    // The probe tells its time in ns; the machine's data of a moment come that delay later.
    const std::int64_t end = kStartNs + 300'000'000;
    std::uint64_t records = 0;
    std::int64_t encoder = kStartNs - 20'000'000;
    for (std::int64_t ns = kStartNs - 20'000'000; ns < end; ns += interval.count()) {
      latch.push(deflectionAt(ns));
      for (; encoder <= ns; encoder += 1'000'000) {
        for (const auto axis : {Axis::x, Axis::y, Axis::z}) latch.push(countAt(axis, encoder));
      }
      latch.setClock(perfectMap((ns - kStartNs) / kPeriodNs));
      while (const auto decision = latch.next()) records += std::holds_alternative<Record>(*decision);
    }
    EXPECT_GT(records, 50U) << interval.count();
    EXPECT_EQ(latch.counters().lost, 0) << interval.count();
    EXPECT_EQ(latch.counters().overwritten, 0U) << interval.count();
  }
}

}  // namespace
}  // namespace probebox::latch_test
