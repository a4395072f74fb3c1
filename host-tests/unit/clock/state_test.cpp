#include <cmath>
#include <gmock/gmock.h>
#include <random>

#include "host-tests/support/no_alloc.hpp"
#include "trial.hpp"

namespace probebox::clock_test {
namespace {

using support::SyncSignal;
using testing::AllOf;
using testing::Gt;
using testing::Lt;

TEST(State, LocksWithinAFewHundredTicksFromADisturbedStart) {
  for (std::uint64_t seed = 0; seed < 50; ++seed) {
    SyncSignal signal;
    signal.jitter = support::StampJitter::lognormal(10000, 0.5, 0.01);
    signal.offset_ppm = -190 + 7.7 * static_cast<double>(seed);
    signal.missing = signal.doubled = signal.spurious = 0.1;
    Trial trial{signal, seed};
    trial.steps(1500);
    EXPECT_EQ(trial.estimator.state(), ClockState::locked) << "seed " << seed;
    EXPECT_NEAR(trial.estimator.offsetPpm(), signal.offset_ppm, 5) << "seed " << seed;
  }
}

TEST(State, FirstTickOfTheFirstLockIsZeroAndSigmaFalls) {
  Trial trial{SyncSignal{}, 1};
  while (trial.estimator.state() == ClockState::unlocked) trial.step();
  EXPECT_EQ(trial.estimator.map().tick.index, 0);
  const auto sigma_at_first = trial.estimator.map().sigma_ns;
  trial.steps(5000);
  EXPECT_LT(trial.estimator.map().sigma_ns, sigma_at_first / 2);
}

TEST(State, NoiseAloneNeverLocks) {
  std::mt19937_64 random{2};
  clock::ClockEstimator estimator{{}};
  std::int64_t at = 0;
  std::exponential_distribution<double> wait{1e-6};
  for (int i = 0; i < 20'000; ++i) {
    at += static_cast<std::int64_t>(wait(random));
    estimator.push({.role = LineRole::sync, .line = 0, .level = Level::active, .line_sequence = 0, .at = monoTime(at)});
    ASSERT_EQ(estimator.state(), ClockState::unlocked) << "edge " << i;
  }
}

TEST(State, FrequencyBeyond200PpmIsRefusedAndCounted) {
  for (const double ppm : {-400.0, -230.0, 230.0, 400.0}) {
    SyncSignal signal;
    signal.offset_ppm = ppm;
    Trial trial{signal, 3};
    for (int i = 0; i < 5000; ++i) {
      trial.step();
      ASSERT_EQ(trial.estimator.state(), ClockState::unlocked) << ppm << " ppm, tick " << i;
    }
    EXPECT_GT(trial.estimator.counters().refused_frequency, 0U) << ppm << " ppm";
  }
}

TEST(State, ASourceThatDriftsBeyond200PpmIsRefusedLater) {
  SyncSignal signal;
  signal.offset_ppm = 190;
  Trial trial{signal, 4};
  trial.steps(2000);
  ASSERT_EQ(trial.estimator.state(), ClockState::locked);
  trial.source.setDriftNs(230);
  trial.steps(60'000);
  EXPECT_EQ(trial.estimator.state(), ClockState::unlocked);
  EXPECT_GT(trial.estimator.counters().refused_frequency, 0U);
}

TEST(State, HalfOrDoubleRateIsNotTakenForTheClock) {
  for (const double period_ns : {2e6, 0.5e6}) {
    SyncSignal signal;
    signal.period_ns = period_ns;
    Trial trial{signal, 5};
    for (int i = 0; i < 3000; ++i) {
      trial.step();
      ASSERT_EQ(trial.estimator.state(), ClockState::unlocked) << period_ns;
    }
  }
}

TEST(Holdover, BridgesSilenceAndKeepsTheIndex) {
  // Short: the next edge is taken as it comes. Long: the grid is found anew, the index comes from the old one.
  for (const std::int64_t ticks : {20, 500, 5000, 14'000}) {
    Trial trial{SyncSignal{}, 6};
    std::int64_t offset = 0;
    const auto note_offset = [&](const Trial::Labelled& edge) {
      if (edge.verdict.tick) offset = edge.verdict.tick->index - *edge.true_tick;
    };
    for (int i = 0; i < 20'000; ++i) trial.step(note_offset);
    const std::int64_t before = offset;
    trial.silence(ticks);
    EXPECT_EQ(trial.estimator.state(), ClockState::holdover) << ticks;
    EXPECT_NEAR(trial.estimator.map().holdover_ms, static_cast<double>(ticks), 3) << ticks;
    for (int i = 0; i < 2000; ++i) trial.step(note_offset);
    EXPECT_EQ(trial.estimator.state(), ClockState::locked) << ticks;
    EXPECT_EQ(offset, before) << ticks;
    EXPECT_EQ(trial.estimator.epoch(), 1U);
    const clock::ClockCounters& counters = trial.estimator.counters();
    EXPECT_NEAR(static_cast<double>(counters.missing + counters.lost_by_kernel), static_cast<double>(ticks), 5)
        << ticks;
  }
}

TEST(Holdover, StatedSigmaIsHonestAndGrows) {
  const double uncertainty_ppm = 2;
  std::mt19937_64 random{7};
  std::normal_distribution<double> ppm{0, uncertainty_ppm};
  double squares = 0;
  constexpr int kRuns = 200;
  for (int seed = 0; seed < kRuns; ++seed) {
    Trial trial{SyncSignal{}, static_cast<std::uint64_t>(seed), {.holdover_ppm = uncertainty_ppm}};
    std::int64_t offset = 0;
    for (int i = 0; i < 5000; ++i) {
      trial.step([&](const Trial::Labelled& edge) {
        if (edge.verdict.tick) offset = edge.verdict.tick->index - *edge.true_tick;
      });
    }
    trial.source.setDriftNs(trial.source.driftNs() + ppm(random));
    trial.silence(1000);
    const auto sigma_early = trial.estimator.map().sigma_ns;
    trial.silence(2000);
    const double pull = trial.errorNs(offset) / trial.estimator.map().sigma_ns;
    squares += pull * pull / kRuns;
    EXPECT_GT(trial.estimator.map().sigma_ns, 2 * sigma_early);
  }
  EXPECT_THAT(squares, AllOf(Gt(0.7), Lt(1.35)));
}

TEST(Holdover, BecomesAmbiguousAtAThirdOfAPeriodOverTheUncertainty) {
  Trial trial{SyncSignal{}, 8, {.holdover_ppm = 20}};
  trial.steps(60'000);
  trial.silence(14'500);
  EXPECT_EQ(trial.estimator.state(), ClockState::holdover);
  trial.silence(1000);
  EXPECT_EQ(trial.estimator.state(), ClockState::ambiguous);
  EXPECT_FALSE(trial.estimator.stamp(trial.last_edge));
}

TEST(Holdover, NextLockIsANewEpochWhoseIndexGoesOn) {
  Trial trial{SyncSignal{}, 9};
  trial.steps(5000);
  trial.silence(20'000);
  ASSERT_EQ(trial.estimator.state(), ClockState::ambiguous);
  const Tick last = trial.estimator.map().tick;
  std::optional<Tick> first;
  for (int i = 0; i < 2000; ++i) {
    trial.step([&](const Trial::Labelled& edge) {
      if (edge.verdict.tick && !first) first = edge.verdict.tick;
    });
  }
  EXPECT_EQ(trial.estimator.state(), ClockState::locked);
  EXPECT_EQ(trial.estimator.epoch(), 2U);
  EXPECT_EQ(trial.estimator.counters().relocks, 1U);
  ASSERT_TRUE(first);
  EXPECT_GT(*first, last);
}

TEST(Holdover, ASignalThatComesBackHalfAPeriodOffIsNotGuessed) {
  Trial trial{SyncSignal{}, 10};
  trial.steps(5000);
  for (int i = 0; i < 10'000; ++i) {
    trial.source.next([&](support::StampedEdge stamped) {
      stamped.edge.at += Nanoseconds{500'000};
      for (const auto& verdict : trial.estimator.push(stamped.edge)) {
        // The last true edge may still have been waiting for its decision.
        if (i > 0) {
          ASSERT_FALSE(verdict.tick);
        }
      }
    });
  }
  EXPECT_EQ(trial.estimator.state(), ClockState::holdover);
}

TEST(Holdover, SilenceIsNoticedOnlyAfterTheDeliveryLatency) {
  Trial trial{SyncSignal{}, 11};
  trial.steps(5000);
  trial.estimator.advance(trial.last_edge + Nanoseconds{25'000'000});
  EXPECT_EQ(trial.estimator.state(), ClockState::locked);
  trial.estimator.advance(trial.last_edge + Nanoseconds{35'000'000});
  EXPECT_EQ(trial.estimator.state(), ClockState::holdover);
}

TEST(NoAlloc, CountsWhatIsAllocated) {
  const support::NoAlloc guard;
  const std::vector<int> some(1000);
  EXPECT_EQ(guard.allocations(), 1U) << some.size();
}

TEST(Tick, PathNeverAllocates) {
  SyncSignal signal;
  signal.missing = signal.doubled = signal.spurious = 0.02;
  support::SyncSource source{signal, 12};
  std::vector<Edge> edges;
  for (int i = 0; i < 100'000; ++i) {
    source.next([&](const support::StampedEdge& stamped) { edges.push_back(stamped.edge); });
  }
  clock::ClockEstimator estimator{{}};
  const support::NoAlloc guard;
  for (const Edge& edge : edges) {
    estimator.push(edge);
    estimator.advance(edge.at);
  }
  estimator.advance(edges.back().at + Nanoseconds{60'000'000'000});
  for (const Edge& edge : edges)
    estimator.push({edge.role, edge.line, edge.level, 0, edge.at + Nanoseconds{200'000'000'000}});
  EXPECT_EQ(guard.allocations(), 0U);
  EXPECT_TRUE(estimator.learned());
}

TEST(Config, RefusesWhatCannotWorkByName) {
  EXPECT_FALSE(clock::validate(clock::ClockConfig{}));
  EXPECT_THAT(clock::validate(clock::ClockConfig{.nominal_period = Nanoseconds{50'000}})->what,
              testing::HasSubstr("nominal period"));
  EXPECT_THAT(clock::validate(clock::ClockConfig{.jitter = Nanoseconds{400'000}})->what, testing::HasSubstr("jitter"));
  EXPECT_THAT(clock::validate(clock::ClockConfig{.frequency_wander_ppb_per_sqrt_s = NAN})->what,
              testing::HasSubstr("wander"));
  EXPECT_THAT(clock::validate(clock::ClockConfig{.max_ppm = 500})->what, testing::HasSubstr("max_ppm"));
}

TEST(Config, TakesAClockThatDoesNotWander) {
  clock::ClockConfig steady;
  steady.phase_wander_ns_per_sqrt_s = 0;
  steady.frequency_wander_ppb_per_sqrt_s = 0;
  steady.holdover_ppm = 0;
  EXPECT_FALSE(clock::validate(steady));
}

}  // namespace
}  // namespace probebox::clock_test
