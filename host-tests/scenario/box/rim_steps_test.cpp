#include <cmath>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <numbers>
#include <random>

#include "firmware/app/results/result_events.hpp"
#include "firmware/metrology/methods.hpp"
#include "firmware/procedure/methods/methods.hpp"
#include "firmware/procedure/plan/readiness.hpp"
#include "host-tests/emulation/scenario.hpp"
#include "host-tests/support/runs.hpp"
#include "measured.hpp"
#include "protocol/units/angle.hpp"
#include "pulls.hpp"
#include "rim_truth.hpp"

// centreline-by-steps on the emulated machine: every loop begins from the zero of C that the one before it has found.
namespace probebox::scenario {
namespace {

using namespace std::chrono_literals;
using procedure::LiveMethod;
using testing::Each;
using testing::ElementsAre;

const std::uint64_t kRimStepSeeds = runs(24);

// An axis and a stylus that are somewhere else than those of the board.
world::Config steppedRimWorld(std::uint64_t seed) {
  world::Config config = usualWorld();
  std::mt19937_64 random{seed};
  const auto within = [&](double most) { return std::uniform_real_distribution<double>{-most, most}(random); };
  auto& part = config.part_spindle;
  part.point_mm[0] += within(0.05);
  part.point_mm[1] += within(0.05);
  for (double& offset : config.probe_spindle.stylus_offset_mm) offset = within(0.03);
  return config;
}

// The ball is put to the line by hand: it stands so far beside it, clockwise, where C is said to have it on the line.
ProcedureOptions rimOptions(Scenario& scenario, double off_line_deg, const ProcedureOptions& chosen = {}) {
  scenario.facts.rim_ball->c_on_line_rad = (90 - off_line_deg) * kDegree;
  return procedure::described(procedure::kCentrelineBySteps, chosen, scenario.facts).value();
}

// How far the ball of the leaning axis stands from +X at C = 0.
double ballFromX(const world::Config& config) {
  const auto& part = config.part_spindle;
  const auto& ball = part.balls_mm[0];
  const auto& lean = part.direction;
  return std::atan2(ball[1] - lean[1] / lean[2] * ball[2], ball[0] - lean[0] / lean[2] * ball[2]);
}

TEST(LiveRimSteps, FindTheCentreWithTheUncertaintyThatTheyState) {
  Pulls pulls, styli;
  for (std::uint64_t seed = 1; seed <= kRimStepSeeds; ++seed) {
    const auto config = steppedRimWorld(seed);
    Scenario scenario{config, seed};
    const auto result = measured(scenario, procedure::kCentrelineBySteps, rimOptions(scenario, 0.9));
    ASSERT_TRUE(result);
    EXPECT_TRUE(result->warnings.empty()) << result->warnings.front();
    const auto centre = trueCentre(config, scenario.machine());
    add(pulls, *result, "centre_mm", {centre[0], centre[1]}, 1e-3);
    const auto& stylus = config.probe_spindle.stylus_offset_mm;
    const double hangs = 150 * config.probe_spindle.direction[0] / config.probe_spindle.direction[2];
    EXPECT_NEAR(result->find("stylus_offset_mm")->values[0], stylus[0] + hangs, 2e-3);
    EXPECT_NEAR(result->find("C_shift_rad")->value(), ballFromX(config) - 0.9 * kDegree, 3e-5);
    if (seed == 1) expectTheSameFrom(scenario.dataset(), *result);
    EXPECT_EQ(metrology::subjectOf(scenario.dataset()), "centreline");
  }
  pulls.expectHonest();
}

TEST(LiveRimSteps, GoRoundUntilTheBallIsOnTheLine) {
  Scenario scenario{steppedRimWorld(2), 2};
  ASSERT_TRUE(measured(scenario, procedure::kCentrelineBySteps, rimOptions(scenario, 0.9)));
  const auto& readings = *scenario.dataset().table("readings");
  EXPECT_THAT(*readings.column("loop"), ElementsAre(1, 1, 2, 2, 2));
  const double theta = 40 * kDegree;
  EXPECT_THAT(*readings.column("C_rad_clockwise_from_plus_y"),
              ElementsAre(testing::DoubleNear(theta, 1e-12), testing::DoubleNear(-theta, 1e-12),
                          testing::DoubleNear(theta, 1e-12), testing::DoubleNear(-theta, 1e-12),
                          testing::DoubleNear(0, 1e-12)));
  const auto& y = *readings.column("y_mm");
  EXPECT_GT(std::abs(y[0] - y[1]), 0.5) << "0.9 degrees on 39 mm";
  EXPECT_LT(std::abs(y[2] - y[3]), 0.01);
  EXPECT_THAT(*scenario.dataset().table("stylus")->column("A_rad"), ElementsAre(0, std::numbers::pi));
  EXPECT_EQ(scenario.state().procedure.steps, 7U * 5U);
}

TEST(LiveRimSteps, NeedOneLoopWhereTheBallIsOnTheLineAtOnce) {
  const auto config = steppedRimWorld(3);
  Scenario scenario{config, 3};
  ASSERT_TRUE(measured(scenario, procedure::kCentrelineBySteps,
                       rimOptions(scenario, ballFromX(config) / kDegree, {.arc_rad = std::numbers::pi / 3})));
  EXPECT_THAT(*scenario.dataset().table("readings")->column("loop"), ElementsAre(1, 1, 1));
}

// An axis that stops beside its angle by more than the limit wants never gets there.
TEST(LiveRimSteps, AreGivenUpAfterFiveLoops) {
  auto config = steppedRimWorld(4);
  config.rotary.noise_rad = 1e-4;
  Scenario scenario{config, 4};
  scenario.facts.rim_ball->level_limit_mm = 1e-6;
  scenario.recorder().keeps_bytes = false;
  scenario.run(2s);
  scenario.activateDelay(scenario.truth().tau_s);
  const auto solved = scenario.calibrate(procedure::kCentrelineBySteps, rimOptions(scenario, 0.9));
  ASSERT_TRUE(solved);
  ASSERT_FALSE(solved->ok());
  EXPECT_EQ(solved->error().name, "not-level");
  EXPECT_EQ(scenario.dataset().table("readings")->rows(), 11U) << "the readings are there nevertheless";
  EXPECT_EQ(scenario.state().procedure.state, procedure::State::refused);
}

// A shared error of the delay makes balls larger, and moves no centre.
TEST(LiveRimSteps, AreNotMovedByAWrongDelay) {
  const auto config = steppedRimWorld(5);
  Scenario scenario{config, 5};
  scenario.recorder().keeps_bytes = false;
  scenario.run(2s);
  auto tau_s = scenario.truth().tau_s;
  for (double& tau : tau_s) tau += 1e-3;
  scenario.activateDelay(tau_s);
  const auto solved = scenario.calibrate(procedure::kCentrelineBySteps, rimOptions(scenario, 0.9));
  ASSERT_TRUE(solved && solved->ok());
  const auto centre = trueCentre(config, scenario.machine());
  const auto* found = solved->value().find("centre_mm");
  for (std::size_t i = 0; i < 2; ++i) EXPECT_LT(std::abs(found->values[i] - centre[i]), 4 * found->sd[i]);
}

TEST(LiveRimSteps, NeedADelayAndDoNotGoOnWithoutOne) {
  Scenario scenario{usualWorld(), 6};
  scenario.recorder().keeps_bytes = false;
  scenario.run(2s);
  const auto solved = scenario.calibrate(procedure::kCentrelineBySteps, rimOptions(scenario, 0.9));
  ASSERT_TRUE(solved && !solved->ok());
  EXPECT_EQ(solved->error().name, "no-delay");
  EXPECT_EQ(scenario.state().procedure.steps, 20U);
}

}  // namespace
}  // namespace probebox::scenario
