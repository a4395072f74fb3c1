#include <gtest/gtest.h>

#include "host-tests/emulation/scenario.hpp"

// Whatever goes wrong on the emulated machine: every sample index comes out once, as a sample or as a declared loss.
namespace probebox::scenario {
namespace {

using namespace std::chrono_literals;
using world::FaultKind;

void expectExactLedger(const Scenario& scenario) {
  const auto& recorded = scenario.recorded();
  const auto& snapshot = scenario.state().snapshot;
  EXPECT_TRUE(recorded.contiguous);
  EXPECT_GT(recorded.received, 0U);
  // What waits in the block that is being filled is produced and not yet delivered.
  EXPECT_GE(snapshot.ledger.produced, recorded.received + recorded.lost_samples);
  EXPECT_LE(snapshot.ledger.produced, recorded.received + recorded.lost_samples + 256);
  EXPECT_EQ(snapshot.ledger.lost_at_source, recorded.lost_samples);
}

TEST(Ledger, LosesNothingOnAGoodMachine) {
  Scenario scenario;
  scenario.run(10s);
  expectExactLedger(scenario);
  EXPECT_EQ(scenario.recorded().lost_samples, 0U);
  EXPECT_NEAR(static_cast<double>(scenario.recorded().received), 2 * 9.8e3, 400);
  EXPECT_EQ(scenario.state().map.state, ClockState::locked);
}

TEST(Ledger, DeclaresTheSamplesOfASilentProbe) {
  Scenario scenario;
  scenario.inject(FaultKind::probe_silent, 3s, 500ms);
  scenario.run(6s);
  expectExactLedger(scenario);
  EXPECT_NEAR(static_cast<double>(scenario.recorded().lost_samples), 1000, 10);
  EXPECT_EQ(scenario.state().lost.deflections, scenario.truth().ledger.dropped_probe);
  EXPECT_TRUE(scenario.state().snapshot.loss_seen);
}

TEST(Ledger, DeclaresTheSamplesOfSilentEncoders) {
  Scenario scenario;
  scenario.inject(FaultKind::encoders_silent, 3s, 250ms);
  scenario.run(6s);
  expectExactLedger(scenario);
  EXPECT_NEAR(static_cast<double>(scenario.recorded().lost_samples), 500, 10);
  EXPECT_EQ(scenario.state().lost.counts, scenario.truth().ledger.dropped_encoders);
}

TEST(Ledger, HoldsOverASilentSyncLineWithoutLoss) {
  Scenario scenario;
  scenario.run(5s);
  scenario.inject(FaultKind::sync_silent, 0s, 2s);
  scenario.run(1s);
  EXPECT_EQ(scenario.state().map.state, ClockState::holdover);
  scenario.run(5s);
  EXPECT_EQ(scenario.state().map.state, ClockState::locked);
  expectExactLedger(scenario);
  EXPECT_EQ(scenario.recorded().lost_samples, 0U);
}

TEST(Ledger, TellsEdgesThatTheKernelLostFromEdgesThatNeverCame) {
  Scenario scenario;
  scenario.run(3s);
  const auto before = scenario.state().snapshot.clock.edges;
  scenario.inject(FaultKind::edges_lost, 100ms, 20ms);
  scenario.run(3s);
  expectExactLedger(scenario);
  EXPECT_EQ(scenario.state().lost.sync_edges, scenario.truth().ledger.lost_edges);
  EXPECT_EQ(scenario.state().lines[0][0].lost, scenario.truth().ledger.lost_edges);
  EXPECT_GT(scenario.state().snapshot.clock.edges.lost, before.lost + 10);
}

TEST(Ledger, KeepsTheIndexThroughDoubledEdges) {
  Scenario scenario;
  scenario.run(3s);
  const auto before = scenario.state().map.tick;
  scenario.inject(FaultKind::edges_doubled, 0s, 1s);
  scenario.run(3s);
  expectExactLedger(scenario);
  EXPECT_EQ(scenario.recorded().lost_samples, 0U);
  EXPECT_NEAR(static_cast<double>(scenario.state().map.tick - before), 3000, 3);
  EXPECT_GT(scenario.state().snapshot.clock.edges.doubled, 900U);
}

TEST(Ledger, GivesEverySampleOneFateWhenTheLinksHaveNoRoom) {
  Scenario scenario;
  scenario.recorder().refuses_every = 3;
  scenario.inject(FaultKind::probe_silent, 2s, 50ms);
  scenario.inject(FaultKind::encoders_silent, 3s, 50ms);
  scenario.inject(FaultKind::probe_silent, 4s, 50ms);
  scenario.run(6s);
  const auto& recorded = scenario.recorded();
  const auto& snapshot = scenario.state().snapshot;
  EXPECT_TRUE(recorded.contiguous);
  EXPECT_GT(recorded.refused_samples, 1000U);
  EXPECT_GT(recorded.lost_samples, 0U);
  EXPECT_EQ(snapshot.ledger.lost_in_queue, recorded.refused_samples);
  EXPECT_EQ(snapshot.ledger.lost_at_source, recorded.lost_samples);
}

TEST(Lines, CountWhatCameAndWhatTheirSequencesLeaveOut) {
  Recorder recorder;
  box::Box box{usualBox(usualWorld()), recorder};
  const auto edge = [&](std::uint8_t line, std::uint32_t sequence) {
    box.push(Edge{LineRole::trigger, line, Level::active, sequence, monoTime(1'000'000 + sequence)});
  };
  edge(0, 3);  // the count begins at 1
  edge(0, 4);
  edge(0, 4);  // a level told again after the chip came back
  edge(0, 9);
  edge(1, 0);  // the level at the start
  edge(1, 1);
  const auto& triggers = box.state().lines[static_cast<std::size_t>(LineRole::trigger)];
  EXPECT_EQ(triggers[0].edges, 3U);
  EXPECT_EQ(triggers[0].lost, 6U);
  EXPECT_EQ(triggers[1].edges, 1U);
  EXPECT_EQ(triggers[1].lost, 0U);
  EXPECT_EQ(box.state().lost.line_edges, 6U);
}

// An edge that is missing before this one may have been the contact or the release.
TEST(Lines, SpoilATouchThatMissesAnEdgeOfItsSwitch) {
  struct Case {
    std::uint8_t line;
    std::uint32_t sequence;
    capture::TouchFault fault;
  };
  constexpr std::uint8_t kSetter = 1, kSwitch = 2, kOther = 3;
  using enum capture::TouchFault;
  for (const auto& [line, sequence, fault] : {Case{kSwitch, 2, source_lost}, Case{kSwitch, 1, clock_not_locked},
                                              Case{kSetter, 2, source_lost}, Case{kOther, 2, clock_not_locked}}) {
    Recorder recorder;
    auto config = usualBox(usualWorld());
    config.tool_setter_line = kSetter;
    config.probe_switch_line = kSwitch;
    box::Box box{config, recorder};
    box.push(ProcedureStarted{.run = 1, .method = procedure::kPreTravel.number, .at = monoTime(0), .options = {}});
    Marker marker{};
    marker.procedure = 1;
    marker.phase = MarkerPhase::begin;
    box.push(marker);
    box.push(Edge{LineRole::trigger, line, Level::active, sequence, monoTime(1'000'000)});
    marker.phase = MarkerPhase::end;
    box.push(marker);
    box.push(TimeAdvanced{monoTime(1'000'000'000)});
    EXPECT_EQ(box.state().procedure.last_fault, fault) << "line " << int{line} << ", sequence " << sequence;
  }
}

TEST(Heartbeat, StandsStillWhileTheChainDeliversNothing) {
  Scenario scenario;
  scenario.run(3s);
  scenario.inject(FaultKind::encoders_silent, 0s, 2s);
  scenario.run(500ms);
  const auto silent = scenario.state().snapshot.heartbeat;
  scenario.run(1s);
  EXPECT_EQ(scenario.state().snapshot.heartbeat, silent);
  scenario.run(2s);
  EXPECT_GT(scenario.state().snapshot.heartbeat, silent);
}

}  // namespace
}  // namespace probebox::scenario
