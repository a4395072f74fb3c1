#include <cmath>
#include <gmock/gmock.h>
#include <vector>

#include "counter_trial.hpp"
#include "host-tests/support/no_alloc.hpp"

namespace probebox::clock_test {
namespace {

using namespace std::chrono_literals;
using support::CounterSignal;
using support::StampJitter;
using testing::AllOf;
using testing::Gt;
using testing::HasSubstr;
using testing::Lt;

TEST(CounterState, LocksWithinSecondsAtAnyFrequencyWithinTheLimit) {
  for (std::uint64_t seed = 0; seed < 40; ++seed) {
    CounterSignal signal;
    signal.offset_ppm = -190 + 9.7 * static_cast<double>(seed);
    signal.jitter = StampJitter::lognormal(100'000, 0.5, 0.05);
    CounterTrial trial{signal, seed};
    EXPECT_TRUE(trial.lock(10s)) << "seed " << seed;
    EXPECT_EQ(trial.clock.epoch(), 1U);
    trial.run(20s);
    EXPECT_EQ(trial.clock.state(), ClockState::locked) << "seed " << seed;
    EXPECT_NEAR(trial.clock.offsetPpm(), trial.source.offsetPpm(), 2) << "seed " << seed;
  }
}

TEST(CounterState, GivesNoTimeBeforeItLocksAndOneToEverySampleAfter) {
  CounterTrial trial{CounterSignal{}, 1};
  std::uint64_t early = 0;
  while (trial.clock.state() != ClockState::locked) {
    early = trial.clock.counters().samples;
    ASSERT_LT(early, 20'000U);
    ASSERT_EQ(trial.clock.counters().stamped, 0U);
    trial.step();
  }
  EXPECT_GT(early, 100U);
  const auto before = trial.clock.counters();
  trial.run(10s);
  const auto& after = trial.clock.counters();
  EXPECT_EQ(after.unstamped, before.unstamped);
  EXPECT_EQ(after.stamped + after.unstamped, trial.source.samples());
  EXPECT_EQ(after.samples, trial.source.samples());
}

TEST(CounterState, SigmaFallsAndEverySampleOfATransferGetsItsOwnTime) {
  CounterSignal signal;
  signal.fewest_samples = signal.most_samples = 20;
  CounterTrial trial{signal, 2};
  ASSERT_TRUE(trial.lock());
  const double at_first = trial.clock.sigmaNs();
  EXPECT_LE(at_first, 20'000);
  EXPECT_GT(stampedWell(trial, 60s), 119'000U);
  EXPECT_LT(trial.clock.sigmaNs(), at_first / 5);
}

TEST(CounterState, FollowsTheCounterThroughItsWrap) {
  CounterSignal signal;
  signal.first_counter = 0xffff'ffff - 20'000;
  CounterTrial trial{signal, 3};
  ASSERT_TRUE(trial.lock());
  trial.run(5s);
  ASSERT_GT(trial.source.counter(), 0xffff'0000U);
  stampedWell(trial, 20s);
  EXPECT_LT(trial.source.counter(), 100'000U);
  EXPECT_EQ(trial.clock.epoch(), 1U);
  EXPECT_EQ(trial.clock.counters().restarts, 0U);
  EXPECT_EQ(trial.clock.counters().missing, 0U);
}

TEST(CounterState, CountsWhatIsLostOnTheWayAndGoesOn) {
  CounterSignal signal;
  signal.lost = 0.3;
  CounterTrial trial{signal, 4};
  ASSERT_TRUE(trial.lock());
  stampedWell(trial, 30s);
  // A loss shows with the next sample that arrives, and not before the first one.
  EXPECT_NEAR(static_cast<double>(trial.clock.counters().missing), static_cast<double>(trial.source.lost()), 40);
  EXPECT_GT(trial.clock.counters().missing, 10'000U);
  EXPECT_EQ(trial.clock.epoch(), 1U);
}

class CounterThatBeginsAnew : public testing::TestWithParam<std::pair<std::uint32_t, bool>> {};

TEST_P(CounterThatBeginsAnew, IsANewEpochWithoutAWrongTime) {
  const auto [counter, says_so] = GetParam();
  CounterTrial trial{CounterSignal{}, 5};
  ASSERT_TRUE(trial.lock());
  trial.run(5s);
  const auto missing = trial.clock.counters().missing;
  trial.source.jump(counter, says_so);
  EXPECT_GT(stampedWell(trial, 10s), 15'000U);
  EXPECT_EQ(trial.clock.state(), ClockState::locked);
  EXPECT_EQ(trial.clock.epoch(), 2U);
  EXPECT_EQ(trial.clock.counters().relocks, 1U);
  EXPECT_EQ(trial.clock.counters().restarts, 1U);
  EXPECT_EQ(trial.clock.counters().missing, missing) << "no loss is claimed across a new beginning";
}

INSTANTIATE_TEST_SUITE_P(BackwardsForwardsAndOnTheSpot, CounterThatBeginsAnew,
                         testing::Values(std::pair{0U, true}, std::pair{0U, false}, std::pair{500'000U, false},
                                         std::pair{0xf000'0000U, false}, std::pair{11'000U, true}));

TEST(CounterState, ACounterThatJumpsALittleIsNoticedByTheTimeThatDidNotPass) {
  CounterTrial trial{CounterSignal{}, 6};
  ASSERT_TRUE(trial.lock());
  trial.run(5s);
  trial.source.jump(trial.source.counter() + 500, false);  // a quarter of a second
  EXPECT_GT(stampedWell(trial, 10s), 15'000U) << "and no sample gets a time in the future";
  EXPECT_EQ(trial.clock.epoch(), 2U);
  EXPECT_EQ(trial.clock.state(), ClockState::locked);
}

TEST(CounterState, ACounterThatPausesIsFoundAgainWhereItIsThen) {
  for (const auto pause : {Nanoseconds{200ms}, Nanoseconds{5s}}) {
    CounterTrial trial{CounterSignal{}, 7};
    ASSERT_TRUE(trial.lock());
    trial.run(5s);
    trial.source.pause(pause);
    // With the short pause, arrivals might only be late: a few tens of them, until they all agree.
    for (int transfer = 0; transfer < 40; ++transfer) trial.step();
    EXPECT_NE(trial.clock.state(), ClockState::locked) << pause.count();
    EXPECT_GT(stampedWell(trial, 10s), 15'000U) << pause.count();
    EXPECT_EQ(trial.clock.epoch(), 2U);
  }
}

TEST(CounterState, RestartForgetsTheLineAndTheCounter) {
  CounterTrial trial{CounterSignal{}, 8};
  ASSERT_TRUE(trial.lock());
  trial.run(1s);
  trial.clock.restart();
  EXPECT_EQ(trial.clock.state(), ClockState::unlocked);
  trial.source.pause(30s);
  trial.source.jump(77, false);
  const auto before = trial.clock.counters();
  EXPECT_GT(stampedWell(trial, 10s), 15'000U);
  EXPECT_EQ(trial.clock.epoch(), 2U);
  EXPECT_EQ(trial.clock.counters().restarts, before.restarts) << "the source said it";
  EXPECT_EQ(trial.clock.counters().missing, before.missing);
}

TEST(CounterState, StampsRiseWhenTheLineMovesBackByMoreThanASample) {
  CounterSignal signal;
  signal.rate_hz = 200'000;
  signal.fewest_samples = signal.most_samples = 100;
  CounterTrial trial{signal, 9};
  ASSERT_TRUE(trial.lock());
  trial.run(5s);
  // Nothing tells the time for a while, and the device runs 60 ppm faster meanwhile: 57 us, or eleven samples.
  trial.source.setOffsetPpm(trial.source.offsetPpm() - 60);
  MonoTime last = MonoTime::min();
  double largest_step_back = 0;
  double error_before = 0;
  const MonoTime blind_until = trial.source.now() + 950ms;
  while (trial.source.now() < blind_until + 1s) {
    for (auto sample : trial.source.next()) {
      sample.event.newest = sample.event.newest && trial.source.now() > blind_until;
      const auto stamp = trial.clock.push(sample.event);
      ASSERT_TRUE(stamp);
      ASSERT_GT(stamp->at, last);
      last = stamp->at;
      const double error = -trial.source.trueNsAfter(sample, stamp->at);
      largest_step_back = std::max(largest_step_back, error_before - error);
      error_before = error;
    }
  }
  EXPECT_GT(largest_step_back, 4990) << "a whole sample: the stamps had to be held back";
}

TEST(CounterState, ANewRunIsANewEpochEvenWhereTheCounterGoesOn) {
  CounterTrial trial{CounterSignal{}, 20};
  ASSERT_TRUE(trial.lock());
  trial.source.jump(trial.source.counter(), true);
  trial.step();
  EXPECT_EQ(trial.clock.state(), ClockState::unlocked);
  EXPECT_EQ(trial.clock.counters().restarts, 1U);
  ASSERT_TRUE(trial.lock());
  EXPECT_EQ(trial.clock.epoch(), 2U);
}

TEST(CounterState, ACounterThatStandsStillBeginsAnewWithEverySample) {
  CounterTrial trial{CounterSignal{}, 21};
  ASSERT_TRUE(trial.lock());
  const auto stuck = trial.source.counter();
  for (std::uint64_t times = 0; times < 10; ++times) {
    trial.source.jump(stuck, false);
    const auto transfer = trial.source.next();
    EXPECT_EQ(trial.clock.push(transfer.front().event).has_value(), times == 0);
    EXPECT_EQ(trial.clock.counters().restarts, times);
  }
}

TEST(CounterState, TimesWhatTheDeviceLatchedBetweenTwoSamples) {
  CounterTrial trial{CounterSignal{}, 24};
  ASSERT_TRUE(trial.lock());
  trial.run(1s);
  const auto transfer = trial.source.next();
  std::optional<clock::CounterStamp> last;
  for (const auto& sample : transfer) last = trial.clock.push(sample.event);
  ASSERT_TRUE(last);
  const auto& event = transfer.back().event;
  const auto half = trial.clock.timeAfter({event.run, event.counter, false, event.at}, 0x8000'0000U);
  ASSERT_TRUE(half);
  EXPECT_NEAR(static_cast<double>((*half - last->at).count()), 250'000, 100) << "half of a period at 2 kHz";
  const auto other_run = static_cast<std::uint8_t>(event.run + 1);
  EXPECT_FALSE(trial.clock.timeAfter({other_run, event.counter, false, event.at}, 0));
}

// A receiver that numbers a latch wrongly must not silence the probe for as long.
TEST(CounterState, ALatchThatIsLaterThanItsArrivalHasNoTimeAndTakesNoneFromTheSamples) {
  CounterTrial trial{CounterSignal{}, 25};
  ASSERT_TRUE(trial.lock());
  trial.run(1s);
  const auto transfer = trial.source.next();
  for (const auto& sample : transfer) trial.clock.push(sample.event);
  const auto& event = transfer.back().event;
  for (const std::uint32_t ahead : {100U, 4000U, 0x8000'0000U})
    EXPECT_FALSE(trial.clock.timeAfter({event.run, event.counter + ahead, false, event.at}, 0)) << ahead;
  EXPECT_GT(stampedWell(trial, 1s), 1900U);
}

TEST(CounterState, JudgesTheFrequencyByTheTrueNominalPeriod) {
  // 3333.333 ns: a whole nanosecond less is 100 ppm.
  CounterSignal signal;
  signal.rate_hz = 300'000;
  signal.fewest_samples = signal.most_samples = 300;
  signal.offset_ppm = 150;
  CounterTrial good{signal, 22};
  ASSERT_TRUE(good.lock());
  good.run(20s);
  EXPECT_NEAR(good.clock.offsetPpm(), good.source.offsetPpm(), 1);
  signal.offset_ppm = -250;
  CounterTrial bad{signal, 23};
  EXPECT_FALSE(bad.lock(20s));
  EXPECT_GT(bad.clock.counters().refused_frequency, 0U);
}

TEST(CounterState, RefusesAFrequencyBeyond200Ppm) {
  for (const double ppm : {-400.0, -230.0, 230.0, 400.0}) {
    CounterSignal signal;
    signal.offset_ppm = ppm;
    CounterTrial trial{signal, 10};
    EXPECT_FALSE(trial.lock(20s)) << ppm << " ppm";
    EXPECT_GT(trial.clock.counters().refused_frequency, 0U) << ppm << " ppm";
    EXPECT_EQ(trial.clock.counters().stamped, 0U);
  }
}

TEST(CounterState, RefusesANominalRateThatIsNotTheDevices) {
  for (const double factor : {0.5, 0.95, 0.997, 1.003, 1.05, 2.0, 10.0}) {
    CounterSignal signal;
    CounterTrial trial{signal, 11};
    clock::CounterClock clock{{.rate_hz = signal.rate_hz * factor}};
    while (trial.source.samples() < 40'000) {
      for (const auto& sample : trial.source.next()) ASSERT_FALSE(clock.push(sample.event)) << factor;
    }
    EXPECT_GT(clock.counters().refused_frequency, 0U) << factor;
  }
}

TEST(CounterState, ADeviceThatDriftsBeyond200PpmIsRefusedLater) {
  CounterSignal signal;
  signal.offset_ppm = 190;
  CounterTrial trial{signal, 12};
  ASSERT_TRUE(trial.lock());
  trial.source.setOffsetPpm(240);
  trial.run(120s);
  EXPECT_NE(trial.clock.state(), ClockState::locked);
  EXPECT_GT(trial.clock.counters().refused_frequency, 0U);
}

TEST(CounterState, AFrequencyThatMovesByAHundredPpmIsFollowed) {
  CounterSignal signal;
  signal.offset_ppm = -50;
  CounterTrial trial{signal, 13};
  ASSERT_TRUE(trial.lock());
  // A device that warms up: 100 ppm in ten minutes.
  for (int second = 0; second < 600; ++second) {
    trial.source.setOffsetPpm(trial.source.offsetPpm() + 100.0 / 600);
    stampedWell(trial, 1s);
  }
  EXPECT_EQ(trial.clock.epoch(), 1U);
  EXPECT_NEAR(trial.clock.offsetPpm(), 50, 3);
}

TEST(CounterState, WhatHadToWaitBeforeTheFirstTransferDoesNotSpoilTheLine) {
  CounterTrial trial{CounterSignal{}, 14};
  // Eight transfers that waited in the device, all at once.
  std::vector<CountedDeflection> backlog;
  for (int transfer = 0; transfer < 8; ++transfer) {
    for (const auto& sample : trial.source.next()) backlog.push_back(sample.event);
  }
  for (auto event : backlog) {
    event.at = trial.source.now() + 1ms;
    EXPECT_FALSE(trial.clock.push(event));
  }
  ASSERT_TRUE(trial.lock());
  stampedWell(trial, 10s);
  EXPECT_EQ(trial.clock.epoch(), 1U);
}

TEST(CounterClock, SameSamplesGiveTheSameBytesAtAnyTimeOfTheClock) {
  CounterSignal signal;
  signal.jitter = StampJitter::lognormal(100'000, 0.5, 0.01);
  constexpr std::int64_t kYearNs = 31'557'600'000'000'000;
  support::CounterSource early{signal, 18, monoTime(1000)};
  support::CounterSource late{signal, 18, monoTime(1000 + 100 * kYearNs)};
  clock::CounterClock from_early{{}};
  clock::CounterClock from_late{{}};
  for (int transfer = 0; transfer < 60'000; ++transfer) {
    const auto a = early.next();
    const auto b = late.next();
    for (std::size_t i = 0; i < a.size(); ++i) {
      const auto at_early = from_early.push(a[i].event);
      const auto at_late = from_late.push(b[i].event);
      ASSERT_EQ(at_early.has_value(), at_late.has_value());
      if (!at_early) continue;
      ASSERT_EQ(toNs(at_early->at), toNs(at_late->at) - 100 * kYearNs);
      ASSERT_EQ(at_early->sigma_ns, at_late->sigma_ns);
    }
  }
}

TEST(CounterClock, NeverAllocates) {
  CounterSignal signal;
  signal.lost = 0.02;
  support::CounterSource source{signal, 19};
  std::vector<CountedDeflection> events;
  for (int transfer = 0; transfer < 60'000; ++transfer) {
    for (const auto& sample : source.next()) events.push_back(sample.event);
    if (transfer == 50'000) source.jump(0, false);
  }
  clock::CounterClock clock{{}};
  const support::NoAlloc guard;
  for (const auto& event : events) {
    clock.push(event);
    clock.advance(event.at);
  }
  clock.advance(events.back().at + 60s);
  clock.restart();
  EXPECT_EQ(guard.allocations(), 0U);
  EXPECT_EQ(clock.counters().restarts, 1U);
  EXPECT_EQ(clock.epoch(), 2U);
}

TEST(CounterConfig, RefusesWhatCannotWorkByName) {
  EXPECT_FALSE(clock::validate(clock::CounterClockConfig{}));
  EXPECT_THAT(clock::validate(clock::CounterClockConfig{.rate_hz = 1})->what,
              AllOf(HasSubstr("1.0"), HasSubstr("rate_hz"), HasSubstr("probe.toml")));
  EXPECT_THAT(clock::validate(clock::CounterClockConfig{.jitter = 0ns})->what, HasSubstr("jitter"));
  EXPECT_THAT(clock::validate(clock::CounterClockConfig{.max_sigma = 0ns})->what, HasSubstr("max_sigma"));
  EXPECT_THAT(clock::validate(clock::CounterClockConfig{.phase_wander_ns_per_sqrt_s = NAN})->what, HasSubstr("wander"));
  EXPECT_THAT(clock::validate(clock::CounterClockConfig{.max_ppm = 500})->what, HasSubstr("max_ppm"));
}

}  // namespace
}  // namespace probebox::clock_test
