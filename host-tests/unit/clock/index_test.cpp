#include <gmock/gmock.h>
#include <map>

#include "trial.hpp"

namespace probebox::clock_test {
namespace {

using support::StampJitter;
using support::SyncSignal;

struct Labels {
  std::int64_t labelled{};
  std::int64_t wrong{};          // another index than its neighbours say
  std::int64_t longest_wrong{};  // in a row: a lasting shift
};

// Index of the estimator minus the source's must stay what it was at the first edge of a known tick after lock.
Labels labelsOf(Trial& trial, std::int64_t ticks) {
  Labels labels;
  std::map<std::int64_t, std::int64_t> offsets;
  std::int64_t wrong_in_a_row = 0;
  std::optional<std::int64_t> usual;
  for (std::int64_t i = 0; i < ticks; ++i) {
    trial.step([&](const Trial::Labelled& edge) {
      if (!edge.verdict.tick) return;
      ++labels.labelled;
      const auto offset = edge.true_tick ? std::optional{edge.verdict.tick->index - *edge.true_tick} : std::nullopt;
      // The most frequent offset of the first 1000 is the one to keep.
      if (labels.labelled <= 1000 && offset) ++offsets[*offset];
      if (labels.labelled == 1000) {
        usual = std::max_element(offsets.begin(), offsets.end(), [](auto& a, auto& b) {
                  return a.second < b.second;
                })->first;
      }
      if (!usual) return;
      const bool is_wrong = offset != usual;
      labels.wrong += is_wrong ? 1 : 0;
      wrong_in_a_row = is_wrong ? wrong_in_a_row + 1 : 0;
      labels.longest_wrong = std::max(labels.longest_wrong, wrong_in_a_row);
    });
  }
  return labels;
}

TEST(Index, NeverShiftsOverAMillionDisturbedEdges) {
  SyncSignal signal;
  signal.jitter = StampJitter::lognormal(10000, 0.5, 0.01);
  signal.missing = signal.doubled = signal.spurious = 0.01;
  Trial trial{signal, 7};
  const Labels labels = labelsOf(trial, kLong);
  EXPECT_GT(labels.labelled, kLong * 97 / 100);
  EXPECT_LE(labels.longest_wrong, 2);
  EXPECT_LT(static_cast<double>(labels.wrong), 5e-4 * static_cast<double>(labels.labelled));
}

TEST(Index, NeverShiftsWhenOneEdgeInTenIsMissingDoubledOrSpurious) {
  SyncSignal signal;
  signal.jitter = StampJitter::lognormal(30000, 0.5, 0.02);
  signal.missing = signal.doubled = signal.spurious = 0.1;
  Trial trial{signal, 8};
  const Labels labels = labelsOf(trial, kLong / 4);
  EXPECT_GT(labels.labelled, kLong / 4 * 85 / 100);
  EXPECT_LE(labels.longest_wrong, 5);
}

TEST(Index, EveryEdgeGetsOneVerdictAndIsCountedOnce) {
  SyncSignal signal;
  signal.missing = signal.doubled = signal.spurious = signal.lost_by_kernel = 0.02;
  Trial trial{signal, 9};
  std::uint64_t verdicts = 0;
  for (int i = 0; i < 20'000; ++i) trial.step([&](const Trial::Labelled&) { ++verdicts; });
  const clock::ClockCounters& c = trial.estimator.counters();
  EXPECT_EQ(verdicts, c.accepted + c.clipped + c.doubled + c.spurious + c.unfitting + c.unlocked);
  EXPECT_LE(c.edges - verdicts, 1U);
}

TEST(Index, DoubledAndSpuriousEdgesGetNoTick) {
  SyncSignal signal;
  signal.doubled = signal.spurious = 0.05;
  Trial trial{signal, 10};
  trial.steps(1000);
  int labelled_bounces = 0;
  int bounces = 0;
  for (int i = 0; i < 20'000; ++i) {
    trial.step([&](const Trial::Labelled& edge) {
      if (edge.true_tick) return;
      ++bounces;
      labelled_bounces += edge.verdict.tick ? 1 : 0;
    });
  }
  ASSERT_GT(bounces, 1500);
  EXPECT_LE(labelled_bounces, bounces / 50);
}

TEST(Index, LineSequenceTellsLostEdgesFromMissingOnes) {
  SyncSignal signal;
  signal.missing = 0.01;
  signal.lost_by_kernel = 0.03;
  Trial trial{signal, 11};
  trial.steps(1000);
  const clock::ClockCounters before = trial.estimator.counters();
  const std::uint64_t missing_before = trial.source.missing();
  const std::uint64_t lost_before = trial.source.lostByKernel();
  trial.steps(50'000);
  const clock::ClockCounters after = trial.estimator.counters();
  const auto near = [](std::uint64_t truth) { return testing::AllOf(testing::Ge(truth - 4), testing::Le(truth + 4)); };
  EXPECT_THAT(after.missing - before.missing, near(trial.source.missing() - missing_before));
  EXPECT_THAT(after.lost_by_kernel - before.lost_by_kernel, near(trial.source.lostByKernel() - lost_before));
}

TEST(Index, WithoutLineSequenceEverythingAbsentIsMissing) {
  SyncSignal signal;
  signal.missing = 0.02;
  support::SyncSource source{signal, 12};
  clock::ClockEstimator estimator{{}};
  for (int i = 0; i < 10'000; ++i) {
    source.next([&](support::StampedEdge stamped) {
      stamped.edge.line_sequence = 0;
      estimator.push(stamped.edge);
    });
  }
  EXPECT_EQ(estimator.counters().lost_by_kernel, 0U);
  EXPECT_GT(estimator.counters().missing, 150U);
}

TEST(Index, EdgeOlderThanADecidedTickIsRefused) {
  Trial trial{SyncSignal{}, 13};
  trial.steps(1000);
  Edge old{.role = LineRole::sync,
           .line = 0,
           .level = Level::active,
           .line_sequence = 0,
           .at = trial.last_edge - Nanoseconds{10'000'000}};
  const auto verdicts = trial.estimator.push(old);
  ASSERT_FALSE(verdicts.empty());
  EXPECT_EQ(verdicts.back().flag, clock::EdgeFlag::unfitting);
  EXPECT_FALSE(verdicts.back().tick);
}

TEST(Index, FallingEdgesAreNoTicks) {
  Trial trial{SyncSignal{}, 14};
  trial.steps(1000);
  const std::uint64_t edges = trial.estimator.counters().edges;
  trial.estimator.push({.role = LineRole::sync,
                        .line = 0,
                        .level = Level::inactive,
                        .line_sequence = 1,
                        .at = trial.last_edge + Nanoseconds{300'000}});
  EXPECT_EQ(trial.estimator.counters().edges, edges);
}

TEST(Index, SameEdgesGiveTheSameBytesAtAnyTimeOfTheClock) {
  SyncSignal signal;
  signal.jitter = StampJitter::lognormal(10000, 0.5, 0.01);
  signal.missing = signal.doubled = signal.spurious = 0.02;
  constexpr std::int64_t kYearNs = 31'557'600'000'000'000;
  support::SyncSource early{signal, 15, monoTime(1000)};
  support::SyncSource late{signal, 15, monoTime(1000 + 100 * kYearNs)};
  clock::ClockEstimator from_early{{}};
  clock::ClockEstimator from_late{{}};
  const auto map_after = [](support::SyncSource& source, clock::ClockEstimator& estimator) {
    source.next([&](const support::StampedEdge& stamped) { estimator.push(stamped.edge); });
    return estimator.map();
  };
  for (int i = 0; i < 80'000; ++i) {
    const TickMap a = map_after(early, from_early);
    const TickMap b = map_after(late, from_late);
    if (a.state == ClockState::unlocked) continue;
    ASSERT_EQ(a.tick, b.tick);
    ASSERT_EQ(toNs(a.at), toNs(b.at) - 100 * kYearNs);
    ASSERT_EQ(a.period_q32_ns, b.period_q32_ns);
    ASSERT_EQ(a.sigma_ns, b.sigma_ns);
  }
}

}  // namespace
}  // namespace probebox::clock_test
