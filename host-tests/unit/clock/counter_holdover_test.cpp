#include <cmath>
#include <gmock/gmock.h>
#include <random>

#include "counter_trial.hpp"

namespace probebox::clock_test {
namespace {

using namespace std::chrono_literals;
using support::CounterSignal;
using testing::AllOf;
using testing::Gt;
using testing::Lt;

TEST(CounterHoldover, GoesOnForAWhileWithoutArrivalsThatTellTheTime) {
  CounterTrial trial{CounterSignal{}, 15};
  ASSERT_TRUE(trial.lock());
  trial.run(60s);
  const double sigma = trial.clock.sigmaNs();
  // Every transfer ends in mid-packet: samples come, and none is known to be the newest.
  std::uint64_t stamped = 0;
  const auto blind = [&](Nanoseconds duration) {
    for (const MonoTime end = trial.source.now() + duration; trial.source.now() < end;) {
      for (auto sample : trial.source.next()) {
        sample.event.newest = false;
        const auto stamp = trial.clock.push(sample.event);
        if (!stamp) continue;
        ++stamped;
        EXPECT_LT(std::abs(trial.source.trueNsAfter(sample, stamp->at)), kFarNs);
      }
    }
  };
  blind(800ms);
  EXPECT_EQ(trial.clock.state(), ClockState::holdover);
  EXPECT_NEAR(static_cast<double>(stamped), 1600, 10);
  EXPECT_GT(trial.clock.sigmaNs(), 5 * sigma);
  blind(1s);
  EXPECT_EQ(trial.clock.state(), ClockState::ambiguous) << "20 ppm over a second are 20 us";
  EXPECT_NEAR(static_cast<double>(stamped), 2000, 20);
  trial.run(1s);
  EXPECT_EQ(trial.clock.state(), ClockState::locked);
  EXPECT_EQ(trial.clock.epoch(), 1U) << "the counter kept the index";
  stampedWell(trial, 5s);
}

TEST(CounterHoldover, SilenceIsNoticedAndTheIndexKept) {
  CounterTrial trial{CounterSignal{}, 16};
  ASSERT_TRUE(trial.lock());
  trial.run(30s);
  trial.clock.advance(trial.source.now() + 510ms);
  EXPECT_EQ(trial.clock.state(), ClockState::locked) << "events may still be on their way";
  trial.clock.advance(trial.source.now() + 530ms);
  EXPECT_EQ(trial.clock.state(), ClockState::holdover);
  trial.clock.advance(trial.source.now() + 5s);
  EXPECT_EQ(trial.clock.state(), ClockState::ambiguous);
  const auto missing = trial.clock.counters().missing;
  const auto lost = trial.source.lost();
  trial.source.silence(5s);
  stampedWell(trial, 5s);
  EXPECT_EQ(trial.clock.state(), ClockState::locked);
  EXPECT_EQ(trial.clock.epoch(), 1U);
  EXPECT_EQ(trial.clock.counters().missing - missing, trial.source.lost() - lost);
}

// The frequency may have moved meanwhile: what was known before the silence must not outweigh what arrives after it.
TEST(CounterHoldover, StatedSigmaIsHonestAfterASilence) {
  std::mt19937_64 random{24};
  std::normal_distribution<double> ppm{0, 10};
  double squares = 0;
  constexpr int kRuns = 100;
  for (int seed = 0; seed < kRuns; ++seed) {
    CounterTrial trial{CounterSignal{}, static_cast<std::uint64_t>(seed), {.holdover_ppm = 10}};
    ASSERT_TRUE(trial.lock());
    trial.run(20s);
    trial.source.setOffsetPpm(trial.source.offsetPpm() + ppm(random));
    trial.source.silence(3s);
    double pull = 0;
    for (const MonoTime end = trial.source.now() + 2s; trial.source.now() < end;) {
      trial.step([&](const CounterTrial::Stamped& sample) { pull = sample.error_ns / sample.stamp.sigma_ns; });
    }
    EXPECT_EQ(trial.clock.state(), ClockState::locked);
    squares += pull * pull / kRuns;
  }
  EXPECT_THAT(squares, AllOf(Gt(0.6), Lt(1.6)));
}

TEST(CounterHoldover, StatedSigmaIsHonest) {
  const double uncertainty_ppm = 2;
  std::mt19937_64 random{17};
  std::normal_distribution<double> ppm{0, uncertainty_ppm};
  double squares = 0;
  constexpr int kRuns = 200;
  for (int seed = 0; seed < kRuns; ++seed) {
    CounterTrial trial{CounterSignal{}, static_cast<std::uint64_t>(seed), {.holdover_ppm = uncertainty_ppm}};
    ASSERT_TRUE(trial.lock());
    trial.run(20s);
    trial.source.setOffsetPpm(trial.source.offsetPpm() + ppm(random));
    double pull = 0;
    for (const MonoTime end = trial.source.now() + 3s; trial.source.now() < end;) {
      for (auto sample : trial.source.next()) {
        sample.event.newest = false;
        const auto stamp = trial.clock.push(sample.event);
        ASSERT_TRUE(stamp);
        pull = trial.source.trueNsAfter(sample, stamp->at) / stamp->sigma_ns;
      }
    }
    squares += pull * pull / kRuns;
  }
  EXPECT_THAT(squares, AllOf(Gt(0.7), Lt(1.35)));
}

}  // namespace
}  // namespace probebox::clock_test
