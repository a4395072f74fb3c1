#include <cmath>
#include <gtest/gtest.h>

#include "firmware/procedure/methods/methods.hpp"
#include "host-tests/emulation/scenario.hpp"
#include "watched_twin.hpp"

// Corrections on the emulated machine: screws that warm up, references that get lost, and what the CNC then reads.
namespace probebox::scenario {
namespace {

using namespace std::chrono_literals;
using published::Health;
using world::FaultKind;

world::Config warmingUp() {
  auto config = warmingWorld();
  // A plane face, so that what is left is the noise.
  for (auto& screw : config.screws) {
    screw->face_um = {};
    screw->time_constant_s = 60;
  }
  return config;
}

class Screws : public testing::Test {
 protected:
  // The nut's error beside what is served against it, mm.
  double leftOver_mm(std::size_t axis) {
    const double position_mm = scenario.machine().positionAt(scenario.now())[axis];
    const double error_mm = scenario.world().screws().nutError_mm(axis, position_mm, scenario.now());
    return error_mm + scenario.state().snapshot.correction_mm[axis];
  }
  const published::Snapshot& served() const { return scenario.state().snapshot; }

  Scenario scenario{warmingUp()};
};

TEST_F(Screws, AreCompensatedOnEveryAxisAsTheyWarmUp) {
  scenario.run(1s);
  ASSERT_TRUE(served().valid);
  EXPECT_TRUE(served().referenced);
  for (int round = 0; round < 12; ++round) {
    scenario.run(10s);
    for (std::size_t axis = 0; axis < 3; ++axis) EXPECT_NEAR(leftOver_mm(axis), 0, 0.6e-3) << axis << " at " << round;
  }
  EXPECT_LT(served().correction_mm[0], -0.015) << "there was something to compensate";
  EXPECT_GT(served().correction_mm[2], 0.005) << "the fixed bearing of Z is at its high end";
}

TEST_F(Screws, FollowTheAxisThroughAMeasuringRun) {
  scenario.run(60s);
  const auto solved = scenario.calibrate();
  ASSERT_TRUE(solved.has_value() && solved->ok()) << (solved ? solved->error().reason : "the run did not end");
  EXPECT_TRUE(served().valid);
  EXPECT_EQ(served().axes[0].reference_losses, 0U) << "the mark was passed at the right count";
  scenario.run(1s);
  for (std::size_t axis = 0; axis < 3; ++axis) EXPECT_NEAR(leftOver_mm(axis), 0, 0.6e-3) << axis;
}

TEST_F(Screws, AreHeldThroughASilenceOfTheirSensors) {
  scenario.run(30s);
  ASSERT_TRUE(served().valid);
  scenario.inject(FaultKind::screw_sensors_silent, 0s, 20s);
  scenario.run(3s);
  EXPECT_TRUE(served().valid);
  EXPECT_TRUE(served().degraded);
  EXPECT_EQ(served().health[0], Health::held);
  EXPECT_FALSE(served().screw_sensors_good);
  const auto held_mm = served().correction_mm;
  scenario.run(10s);
  EXPECT_FALSE(served().valid);
  EXPECT_EQ(served().correction_mm, held_mm) << "frozen, never back to zero";
  scenario.run(12s);
  EXPECT_TRUE(served().valid);
  EXPECT_FALSE(served().degraded);
  EXPECT_NEAR(leftOver_mm(0), 0, 0.6e-3);
}

TEST_F(Screws, AreCompensatedWithoutAProbeAsInEveryCut) {
  scenario.inject(FaultKind::probe_silent, 0s, 200s);
  scenario.run(2s);
  ASSERT_TRUE(served().valid);
  const auto beats = served().heartbeat;
  for (int round = 0; round < 6; ++round) {
    scenario.run(10s);
    EXPECT_FALSE(served().degraded) << round;
    for (std::size_t axis = 0; axis < 3; ++axis) EXPECT_NEAR(leftOver_mm(axis), 0, 0.6e-3) << axis << " at " << round;
  }
  EXPECT_NEAR(static_cast<std::uint16_t>(served().heartbeat - beats), 600, 2);
  EXPECT_LT(served().correction_mm[0], -0.005) << "there was something to compensate";
}

TEST_F(Screws, WhoseSensorIsSilentLetNobodyMeasure) {
  scenario.run(30s);
  // Through T_hold it is known well enough where the tool is.
  scenario.inject(FaultKind::screw_sensors_silent, 0s, 600s);
  scenario.run(3s);
  scenario.start(procedure::kDelayMultiSpeed);
  scenario.run(1s);
  EXPECT_EQ(scenario.state().procedure.last_fault, capture::TouchFault::none);
  ASSERT_TRUE(scenario.runUntil([&] { return scenario.state().procedure.state == procedure::State::refused; }, 150s));
  EXPECT_EQ(scenario.state().procedure.last_fault, capture::TouchFault::screw_unknown);
}

TEST_F(Screws, SayNothingWithoutAReference) {
  scenario.run(20s);
  ASSERT_TRUE(served().valid);
  // The counts stand still while the machine measures: its marks then come where the counts know of none.
  scenario.start(procedure::kDelayMultiSpeed);
  scenario.inject(FaultKind::encoders_stuck, 0s, 30s);
  ASSERT_TRUE(scenario.runUntil([this] { return !served().valid; }, 60s));
  const auto& axes = served().axes;
  EXPECT_GT(axes[0].reference_losses + axes[1].reference_losses + axes[2].reference_losses, 0U);
  EXPECT_FALSE(served().referenced);
  const auto frozen_mm = served().correction_mm;
  scenario.run(5s);
  EXPECT_EQ(served().correction_mm, frozen_mm);
}

TEST_F(Screws, GoOnFromWhereTheMachineStandsAfterARestart) {
  scenario.run(90s);
  const auto applied_mm = served().correction_mm;
  ASSERT_LT(applied_mm[0], -0.01);
  scenario.restartBox();
  scenario.push(AppliedRestored{.correction_mm = applied_mm, .at = scenario.now()});
  double furthest_mm = 0;
  bool was_invalid = false;
  for (int i = 0; i < 500; ++i) {
    scenario.run(10ms);
    was_invalid = was_invalid || !served().valid;
    furthest_mm = std::max(furthest_mm, std::abs(served().correction_mm[0] - applied_mm[0]));
  }
  EXPECT_TRUE(was_invalid) << "nothing is known right after a start";
  EXPECT_TRUE(served().valid) << "homed by the controller";
  EXPECT_LT(furthest_mm, 2e-3) << "never by way of zero";
}

// How far from the surface the last trigger of a run shows the ball's centre, mm: it came in at 40 mm/s.
double offTheSurface(Scenario& scenario) {
  const auto solved = scenario.calibrate();
  EXPECT_TRUE(solved.has_value() && solved->ok());
  scenario.run(1s);
  const auto& stamp = scenario.state().snapshot.last_trigger;
  EXPECT_GE(stamp.number, 25U);
  EXPECT_TRUE(stamp.served.valid);
  const auto truth = scenario.truth();
  double distance_mm = 0;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    EXPECT_TRUE(stamp.has_position[axis]);
    distance_mm = std::hypot(distance_mm, stamp.position_mm[axis] - truth.sphere_centre_mm[axis]);
  }
  return distance_mm - truth.effective_radius_mm;
}

TEST(Delay, InForceIsInTheSamplesThatPlaceATrigger) {
  Scenario late{warmingWorld()}, right{warmingWorld()};
  EXPECT_NEAR(offTheSurface(late), 40 * late.truth().tau_s[2], 0.02) << "the positions are stale by the delay";
  right.run(2s);
  right.activateDelay(right.truth().tau_s);
  EXPECT_TRUE(right.state().delay_applied);
  EXPECT_NEAR(offTheSurface(right), 0, 0.005);
  EXPECT_EQ(right.state().snapshot.unplaced_triggers, 0U);
  EXPECT_TRUE(right.recorded().contiguous);
}

TEST(Delay, InForceIsInTheCountsThatPlaceATriggerWithoutSamples) {
  const auto firstTouch = [](bool silent) {
    Scenario scenario{warmingWorld()};
    scenario.run(2s);
    scenario.activateDelay(scenario.truth().tau_s);
    scenario.start(procedure::kDelayMultiSpeed);
    if (silent) scenario.inject(FaultKind::probe_silent, 0s, 600s);
    EXPECT_TRUE(scenario.runUntil([&] { return scenario.state().snapshot.last_trigger.number == 1; }, 120s));
    EXPECT_EQ(scenario.state().snapshot.unplaced_triggers, 0U);
    return scenario.state().snapshot.last_trigger;
  };
  const auto sampled = firstTouch(false), counted = firstTouch(true);
  EXPECT_EQ(sampled.at, counted.at);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    EXPECT_TRUE(counted.has_position[axis]) << axis;
    EXPECT_NEAR(counted.position_mm[axis], sampled.position_mm[axis], 1e-3) << axis;
  }
}

TEST(Delay, ThatNoBufferSpansIsNotTakenForApplied) {
  Scenario scenario;
  scenario.run(2s);
  scenario.activateDelay({5.0, 5.0, 5.0});
  EXPECT_FALSE(scenario.state().delay_applied);
  const std::array<Event, 1> five_seconds{DelayActivated{.result_id = 3, .tau_s = {5, 5, 5}, .sd_s = {}, .at = {}}};
  const auto unfit = box::validateActivation(usualBox(usualWorld()), five_seconds);
  ASSERT_TRUE(unfit);
  EXPECT_NE(unfit->what.find("cannot move its samples"), std::string::npos);
}

// Whoever let a result come into force may not have heard of the cut yet.
TEST(Cut, IsOverBeforeAnythingThatIsServedChanges) {
  Scenario scenario;
  scenario.run(1s);
  scenario.push(CutInhibit{.active = true, .at = scenario.now()});
  scenario.activateDelay({5e-3, 5e-3, 5e-3});
  scenario.push(SourcesEnabled{.mask = 0, .at = scenario.now()});
  const auto mask = scenario.state().snapshot.mask;
  scenario.run(1s);
  EXPECT_TRUE(scenario.state().snapshot.inhibited);
  EXPECT_FALSE(scenario.state().snapshot.delay.calibrated);
  EXPECT_EQ(scenario.state().snapshot.mask, mask);
  scenario.push(CutInhibit{.active = false, .at = scenario.now()});
  scenario.run(1s);
  EXPECT_TRUE(scenario.state().snapshot.delay.calibrated);
  EXPECT_TRUE(scenario.state().delay_applied);
  EXPECT_EQ(scenario.state().snapshot.mask, 0);
  EXPECT_EQ(scenario.state().lost.queue_events, 0U);
}

TEST_F(Screws, TakeNoMemoryOnTheTickPath) {
  WatchedTwin twin{scenario, warmingUp()};
  ASSERT_TRUE(scenario.calibrate());
  scenario.activateDelay(scenario.truth().tau_s);
  scenario.run(2s);
  EXPECT_TRUE(twin.box.state().snapshot.valid);
  EXPECT_EQ(twin.allocations, 0U);
}

}  // namespace
}  // namespace probebox::scenario
