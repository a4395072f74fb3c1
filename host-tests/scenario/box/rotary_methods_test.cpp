#include <cmath>
#include <gtest/gtest.h>

#include "firmware/procedure/methods/methods.hpp"
#include "host-tests/emulation/scenario.hpp"
#include "host-tests/support/runs.hpp"
#include "pulls.hpp"

// Methods that turn the part and the probe, run on the emulated machine.
namespace probebox::scenario {
namespace {

using namespace std::chrono_literals;
using procedure::LiveMethod;

// Where the axis C passes the height, relative to the machine's reference with the stylus at A = 0.
std::array<double, 2> axisAt(const world::Truth& truth, const world::Config& config, double z_mm) {
  const auto& [point, along] = std::pair{truth.part_axis_point_mm, truth.part_axis};
  std::array<double, 2> at{};
  for (std::size_t i = 0; i < 2; ++i) {
    at[i] = point[i] + along[i] / along[2] * (z_mm - point[2]) - config.probe_spindle.stylus_offset_mm[i];
  }
  return at;
}

Scenario& readied(Scenario& scenario) {
  scenario.recorder().keeps_bytes = false;
  scenario.run(2s);
  scenario.activateDelay(scenario.truth().tau_s);
  return scenario;
}

TEST(LiveCentreline, ReadsTheBallAtEveryAngle) {
  Scenario scenario{usualWorld(), 3};
  const auto solved = readied(scenario).calibrate(procedure::kCentreline, {.angles = 4});
  ASSERT_TRUE(solved);
  EXPECT_EQ(scenario.machine().stylus().contactCount(), 25U);
  EXPECT_EQ(scenario.machine().crashes(), 0U);
  const auto* readings = scenario.dataset().table("readings");
  ASSERT_NE(readings, nullptr);
  EXPECT_EQ(readings->rows(), 5U) << "the first angle again, last";
  const auto* centres = scenario.dataset().table("centres");
  ASSERT_NE(centres, nullptr);
  // The ball stands 140 mm above the axis' point, 30 mm from the axis.
  const auto centre = axisAt(scenario.truth(), usualWorld(), -160);
  for (std::size_t i = 0; i < 4; ++i) {
    const double dx = readings->column("x_mm")->at(i) - centre[0], dy = readings->column("y_mm")->at(i) - centre[1];
    // The lean of the axis takes up to 140 mm x 0.42 mrad off the arm.
    EXPECT_NEAR(std::hypot(dx, dy), 30, 0.06);
    EXPECT_NEAR(std::remainder(std::atan2(dy, dx) - readings->column("C_rad")->at(i), 2 * M_PI), 0, 2e-3);
    EXPECT_NEAR(centres->column("z_mm")->at(i), -160, 0.05);
    EXPECT_LT(centres->column("sd_x_mm")->at(i), 1e-3);
  }
}

TEST(LiveCentreline, FindsTheAxisWithTheUncertaintyThatItStates) {
  Pulls pulls;
  for (std::uint64_t seed = 1; seed <= runs(20); ++seed) {
    world::Config config = usualWorld();
    config.part_spindle.point_mm[0] += 0.01 * static_cast<double>(seed);
    Scenario scenario{config, seed};
    const auto solved = readied(scenario).calibrate(procedure::kCentreline, {.angles = 5});
    ASSERT_TRUE(solved && solved->ok()) << (solved ? solved->error().reason : "did not end");
    EXPECT_TRUE(solved->value().warnings.empty());
    const auto* centre = solved->value().find("centre_mm");
    const auto truth = axisAt(scenario.truth(), config, -160);
    for (std::size_t i = 0; i < 2; ++i) {
      EXPECT_LT(centre->sd[i], 6e-4);
      pulls.add(centre->values[i], truth[i], centre->sd[i]);
    }
  }
  pulls.expectHonest();
}

TEST(LiveAlignment, FindsTheLeanOfTheAxisWithTheUncertaintyThatItStates) {
  Pulls pulls;
  for (std::uint64_t seed = 1; seed <= runs(20); ++seed) {
    Scenario scenario{usualWorld(), seed};
    const auto solved = readied(scenario).calibrate(procedure::kCAxisAlignment, {.balls = 2});
    ASSERT_TRUE(solved && solved->ok()) << (solved ? solved->error().reason : "did not end");
    EXPECT_EQ(scenario.machine().stylus().contactCount(), 45U);
    EXPECT_EQ(scenario.machine().crashes(), 0U);
    const auto* tilt = solved->value().find("C_tilt_rad");
    const auto axis = scenario.truth().part_axis;
    for (std::size_t i = 0; i < 2; ++i) {
      EXPECT_LT(tilt->sd[i], 2e-5);
      pulls.add(tilt->values[i], axis[i] / axis[2], tilt->sd[i]);
    }
  }
  pulls.expectHonest();
}

TEST(LiveAlignment, ReadsAllBallsOfTheHolder) {
  Scenario scenario{usualWorld(), 5};
  const auto solved = readied(scenario).calibrate(procedure::kCAxisAlignment);
  ASSERT_TRUE(solved && solved->ok());
  EXPECT_EQ(scenario.dataset().table("readings")->rows(), 13U);
  const auto* tilt = solved->value().find("C_tilt_rad");
  const auto axis = scenario.truth().part_axis;
  for (std::size_t i = 0; i < 2; ++i) EXPECT_LT(std::abs(tilt->values[i] - axis[i] / axis[2]), 4 * tilt->sd[i]);
}

// Centre and radius of the first ball, read with a delay in force that is off by so much.
std::array<double, 3> readWith(double off_s) {
  Scenario scenario{usualWorld(), 4};
  scenario.recorder().keeps_bytes = false;
  scenario.run(2s);
  auto tau_s = scenario.truth().tau_s;
  for (double& of_axis : tau_s) of_axis += off_s;
  scenario.activateDelay(tau_s);
  const auto solved = scenario.calibrate(procedure::kCentreline, {.angles = 2});
  EXPECT_TRUE(solved && solved->ok());
  const auto& centre = solved->value().find("centre_mm")->values;
  return {centre[0], centre[1], scenario.dataset().table("centres")->column("radius_mm")->at(0)};
}

TEST(LiveReadings, TakeTheDelayOutOfTheRadiusAndNeverNeedItForTheCentre) {
  const auto right = readWith(0), late = readWith(1e-3);
  EXPECT_NEAR(right[2], 6 + 3, 1e-3);
  // M = P - tau v: who takes out 1 ms too much puts every point 15 um too far outside.
  EXPECT_NEAR(late[2] - right[2], 15e-3, 1e-4);
  EXPECT_NEAR(late[0], right[0], 1e-5);
  EXPECT_NEAR(late[1], right[1], 1e-5);
}

TEST(LiveReadings, AreRefusedWithoutADelayAndTheTouchesAreKept) {
  Scenario scenario{usualWorld(), 4};
  scenario.recorder().keeps_bytes = false;
  scenario.run(2s);
  const auto solved = scenario.calibrate(procedure::kCentreline, {.angles = 2});
  ASSERT_TRUE(solved);
  ASSERT_FALSE(solved->ok());
  EXPECT_EQ(solved->error().name, "no-delay");
  EXPECT_EQ(scenario.dataset().table("touches")->rows(), 15U);
  EXPECT_EQ(scenario.dataset().table("readings"), nullptr);
}

TEST(LiveProcedure, GoesOnAfterALossAndAfterTheBoxWasRestarted) {
  Scenario scenario{usualWorld(), 6};
  readied(scenario);
  // A gap in the sync spoils the touches under way: they are asked for again.
  const auto run = scenario.start(procedure::kCentreline, {.angles = 3});
  ASSERT_TRUE(scenario.runUntil([&] { return scenario.state().procedure.step == 4; }, 60s));
  scenario.inject(world::FaultKind::sync_silent, 0s, 1500ms);
  const auto solved = scenario.finish(run);
  ASSERT_TRUE(solved && solved->ok());
  EXPECT_GT(scenario.machine().stylus().contactCount(), 15U);

  scenario.start(procedure::kCentreline, {.angles = 3});
  ASSERT_TRUE(scenario.runUntil([&] { return scenario.state().procedure.step == 7; }, 60s));
  scenario.runUntil([&] { return scenario.controller().activity() == world::Activity::dwelling; }, 10s);
  scenario.restartBox();
  scenario.run(10s);
  EXPECT_EQ(scenario.controller().activity(), world::Activity::asking) << "the machine has left the ball and parked";
  scenario.activateDelay(scenario.truth().tau_s);
  const auto anew = scenario.calibrate(procedure::kCentreline, {.angles = 3});
  ASSERT_TRUE(anew && anew->ok());
  EXPECT_EQ(scenario.machine().crashes(), 0U);
}

}  // namespace
}  // namespace probebox::scenario
