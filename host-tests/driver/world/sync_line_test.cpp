#include <algorithm>
#include <cmath>
#include <gtest/gtest.h>

#include "streams.hpp"

namespace probebox::world {
namespace {

using testing::Line;
using testing::quiet;
using testing::run;
using testing::seconds;

std::size_t gaps(const std::vector<Edge>& edges) {
  std::size_t lost = edges.empty() ? 0 : edges.front().line_sequence - 1;
  for (std::size_t i = 1; i < edges.size(); ++i) lost += edges[i].line_sequence - edges[i - 1].line_sequence - 1;
  return lost;
}

std::uint64_t expectedEdges(const Ledger& ledger) {
  return ledger.ticks - ledger.missing_edges - ledger.silent_edges + ledger.doubled_edges + ledger.spurious_edges -
         ledger.lost_edges;
}

// Stamps minus true ticks, us, of edges that are ticks; at most the latest that are remembered.
std::vector<double> lateness(const World& world, const std::vector<Edge>& edges) {
  std::vector<double> late_us;
  for (const Edge& edge : edges) {
    const auto origin = world.trueEdge(edge.line_sequence);
    if (!origin || origin->origin != EdgeOrigin::tick) continue;
    const auto tick = world.trueTick(origin->tick);
    if (tick) late_us.push_back(1e-3 * static_cast<double>((edge.at - tick->at).count()));
  }
  return late_us;
}

TEST(SyncLine, TicksWithTheConfiguredDrift) {
  for (const double drift_ppm : {-150.0, 0.0, 37.5}) {
    Config config = quiet();
    config.clock.drift_ppm = drift_ppm;
    World world{config, 7};
    const auto edges = run(world, 100).edges;
    const double length_ns = static_cast<double>((edges.back().at - edges.front().at).count());
    const double ppm = 1e6 * (length_ns / (1e6 * static_cast<double>(edges.size() - 1)) - 1);
    EXPECT_NEAR(ppm, drift_ppm, 1e-4);
    EXPECT_NEAR(world.truth().drift_ppm, drift_ppm, 1e-9);
  }
}

TEST(SyncLine, FrequencyWandersAsMuchAsConfigured) {
  std::vector<double> after_4_s;
  for (std::uint64_t seed = 0; seed < 200; ++seed) {
    Config config = quiet();
    config.clock.wander_ppm = 0.5;
    World world{config, seed};
    run(world, 4);
    after_4_s.push_back(world.truth().drift_ppm);
  }
  const auto [mean, sd] = testing::momentsOf(after_4_s);
  EXPECT_NEAR(mean, 0, 4 * 1.0 / std::sqrt(200));
  EXPECT_NEAR(sd, 0.5 * std::sqrt(4), 4 * 1.0 / std::sqrt(400));
}

TEST(SyncLine, GaussianStampsAreLateByBiasAndJitter) {
  Config config = quiet();
  config.clock.jitter = Jitter::gauss;
  config.clock.bias_us = 20;
  config.clock.jitter_us = 5;
  World world{config, 3};
  const auto late_us = lateness(world, run(world, 4).edges);
  ASSERT_GT(late_us.size(), 3900U);
  const auto [mean, sd] = testing::momentsOf(late_us);
  EXPECT_NEAR(mean, 20, 4 * 5 / std::sqrt(4000));
  EXPECT_NEAR(sd, 5, 4 * 5 / std::sqrt(8000));
}

TEST(SyncLine, LognormalStampsAreSkewedAroundTheirMedian) {
  Config config = quiet();
  config.clock.jitter = Jitter::lognormal;
  config.clock.bias_us = 10;
  config.clock.jitter_us = 30;
  World world{config, 3};
  auto late_us = lateness(world, run(world, 4).edges);
  std::sort(late_us.begin(), late_us.end());
  ASSERT_GT(late_us.size(), 3900U);
  const double median = late_us[late_us.size() / 2];
  EXPECT_NEAR(median, 40, 1.5);
  EXPECT_NEAR(late_us[late_us.size() * 84134 / 100000] - 10, 30 * std::exp(0.5), 3);
  EXPECT_GT(testing::momentsOf(late_us).mean, median + 2);
}

TEST(SyncLine, CountsEveryFaultExactly) {
  Config config = testing::usual();
  config.clock.missing_probability = 0.01;
  config.clock.doubled_probability = 0.02;
  config.clock.spurious_probability = 0.03;
  config.clock.outlier_us = 3000;  // outliers overtake later edges
  World world{config, 11};
  const auto edges = run(world, 60).edges;
  const Ledger ledger = world.truth().ledger;
  EXPECT_NEAR(static_cast<double>(ledger.ticks), 60'000, 3);
  EXPECT_NEAR(static_cast<double>(ledger.missing_edges), 600, 100);
  EXPECT_NEAR(static_cast<double>(ledger.doubled_edges), 1200, 140);
  EXPECT_NEAR(static_cast<double>(ledger.spurious_edges), 1800, 170);
  EXPECT_NEAR(static_cast<double>(ledger.outlier_edges), 300, 70);
  EXPECT_EQ(edges.size(), expectedEdges(ledger));
  EXPECT_EQ(gaps(edges), 0U);
  for (std::size_t i = 1; i < edges.size(); ++i) ASSERT_LT(edges[i - 1].at, edges[i].at);
}

TEST(SyncLine, ASilentLineLeavesNoSequenceGapAndALosingKernelDoes) {
  World world{quiet(), 5};
  ASSERT_TRUE(
      world.inject({.kind = FaultKind::sync_silent, .at = seconds(1), .duration = std::chrono::milliseconds{250}}));
  ASSERT_TRUE(
      world.inject({.kind = FaultKind::edges_lost, .at = seconds(2), .duration = std::chrono::milliseconds{40}}));
  const auto edges = run(world, 3).edges;
  const Ledger ledger = world.truth().ledger;
  EXPECT_EQ(ledger.silent_edges, 250U);
  EXPECT_EQ(ledger.lost_edges, 40U);
  EXPECT_EQ(gaps(edges), 40U);
  EXPECT_EQ(edges.size(), expectedEdges(ledger));
  EXPECT_TRUE(std::none_of(edges.begin(), edges.end(), [](const Edge& edge) {
    return (edge.at >= seconds(1) && edge.at < seconds(1.25)) || (edge.at >= seconds(2) && edge.at < seconds(2.04));
  }));
}

TEST(SyncLine, DoublesEveryEdgeWhileTold) {
  World world{quiet(), 5};
  ASSERT_TRUE(
      world.inject({.kind = FaultKind::edges_doubled, .at = seconds(1), .duration = std::chrono::milliseconds{100}}));
  const auto edges = run(world, 2).edges;
  EXPECT_EQ(world.truth().ledger.doubled_edges, 100U);
  const auto doubled = std::count_if(edges.begin(), edges.end(), [&](const Edge& edge) {
    return world.trueEdge(edge.line_sequence)->origin == EdgeOrigin::doubled;
  });
  EXPECT_EQ(doubled, 100);
}

TEST(SyncLine, JumpsOnceByThePhaseThatIsAsked) {
  World world{quiet(), 5};
  const Nanoseconds jump{300'000};
  ASSERT_TRUE(world.inject({.kind = FaultKind::clock_jumps, .at = seconds(1), .duration = {}, .jump = jump}));
  const auto edges = run(world, 2).edges;
  std::vector<Nanoseconds> uncommon;
  for (std::size_t i = 1; i < edges.size(); ++i) {
    const Nanoseconds interval = edges[i].at - edges[i - 1].at;
    if (interval != Nanoseconds{1'000'000}) uncommon.push_back(interval);
  }
  ASSERT_EQ(uncommon.size(), 1U);
  EXPECT_EQ(uncommon[0], Nanoseconds{1'000'000} + jump);
  EXPECT_EQ(world.truth().ledger.clock_jumps, 1U);
}

TEST(SyncLine, StampsNeverGoBackThoughTheClockDoes) {
  World world{quiet(), 5};
  const Nanoseconds jump{-2'500'000};
  ASSERT_TRUE(world.inject({.kind = FaultKind::clock_jumps, .at = seconds(1), .duration = {}, .jump = jump}));
  const auto edges = run(world, 2).edges;
  for (std::size_t i = 1; i < edges.size(); ++i) ASSERT_LT(edges[i - 1].at, edges[i].at);
  EXPECT_EQ(edges.size(), world.truth().ledger.ticks);
}

TEST(SyncLine, RemembersNoMoreFaultsThanItSays) {
  World world{quiet(), 5};
  for (std::size_t i = 0; i < FaultSchedule::kMostFaults; ++i) ASSERT_TRUE(world.inject(Fault{}));
  EXPECT_FALSE(world.inject(Fault{}));
}

TEST(SyncLine, PhysicalEdgesAreTheEdgesThatEventsWouldBe) {
  Config config = testing::usual();
  config.clock.missing_probability = 0.01;
  config.clock.doubled_probability = 0.01;
  World events{config, 9};
  config.edges_as_events = false;
  World physical{config, 9};
  for (World* world : {&events, &physical}) {
    world->inject({.kind = FaultKind::edges_lost, .at = seconds(3), .duration = std::chrono::milliseconds{10}});
  }
  const auto edges = run(events, 5).edges;
  EXPECT_TRUE(run(physical, 5).edges.empty());

  std::vector<Edge> stamped;
  std::uint32_t sequence = 0;
  std::array<PhysicalEdge, 16> some;
  for (std::size_t n = physical.pollEdges(some); n > 0; n = physical.pollEdges(some)) {
    for (const PhysicalEdge& edge : std::span{some}.first(n)) {
      ++sequence;
      if (!edge.lost) stamped.push_back({edge.role, edge.line, edge.level, sequence, edge.at});
    }
  }
  ASSERT_EQ(stamped.size(), edges.size());
  for (std::size_t i = 0; i < edges.size(); ++i) {
    ASSERT_EQ(stamped[i].at, edges[i].at);
    ASSERT_EQ(stamped[i].line_sequence, edges[i].line_sequence);
  }
  EXPECT_EQ(physical.truth().ledger.lost_edges, events.truth().ledger.lost_edges);
}

}  // namespace
}  // namespace probebox::world
