#include <cmath>
#include <gtest/gtest.h>
#include <numbers>
#include <string>
#include <vector>

#include "firmware/app/results/result_events.hpp"
#include "firmware/metrology/methods.hpp"
#include "firmware/procedure/methods/methods.hpp"
#include "host-tests/emulation/scenario.hpp"
#include "host-tests/support/runs.hpp"
#include "measured.hpp"
#include "pulls.hpp"

// Methods that read one ball of the part in several poses, run on the emulated machine.
namespace probebox::scenario {
namespace {

using namespace std::chrono_literals;
using procedure::LiveMethod;
using world::operator*;
using world::operator+;
using world::operator-;

const std::uint64_t kBallSeeds = runs(12);

// Of the emulated machine, in X and Y at the height of the ball.
struct Truth {
  std::array<double, 2> offset{};  // axis C less the axis of the probe's spindle
  std::array<double, 2> stylus{};  // the stylus ball from that axis at A = 0
  std::array<double, 2> centre{};  // axis C for a probe whose spindle stands at A = 0
  std::array<double, 2> arm{};     // the ball from axis C at C = 0
};

Truth truthOf(const world::Config& config) {
  const auto& part = config.part_spindle;
  const auto c = world::unit(part.direction), a = world::unit(config.probe_spindle.direction);
  const auto& [sx, sy] = config.probe_spindle.stylus_offset_mm;
  const world::Vector3 hanging{sx, sy, -config.probe_spindle.stylus_length_mm};
  const auto on_c = part.point_mm + world::dot(c, part.balls_mm[0]) * c;
  const auto on_a = world::dot(a, hanging) * a;
  Truth truth;
  for (std::size_t i = 0; i < 2; ++i) {
    truth.offset[i] = on_c[i] - on_a[i];
    truth.stylus[i] = hanging[i] - on_a[i];
    truth.centre[i] = on_c[i] - hanging[i];
    truth.arm[i] = part.point_mm[i] + part.balls_mm[0][i] - on_c[i];
  }
  return truth;
}

world::Config ballWorld(std::uint64_t seed) {
  world::Config config = usualWorld();
  const auto step = static_cast<double>(seed);
  config.part_spindle.point_mm[0] += 0.01 * step;
  config.probe_spindle.stylus_offset_mm[1] -= 0.003 * step;
  return config;
}

std::vector<double> both(const std::array<double, 2>& xy) {
  return {xy[0], xy[1]};
}

TEST(LiveSpindleOffset, OfFourPosesTellsAxesAndStylusApart) {
  Pulls offset, stylus;
  for (std::uint64_t seed = 1; seed <= kBallSeeds; ++seed) {
    const auto config = ballWorld(seed);
    Scenario scenario{config, seed};
    const auto result = measured(scenario, procedure::kSpindleOffset2x2);
    ASSERT_TRUE(result);
    const auto truth = truthOf(config);
    add(offset, *result, "offset_C_minus_A_mm", both(truth.offset), 6e-4);
    add(stylus, *result, "stylus_offset_mm", both(truth.stylus), 6e-4);
    if (seed == 1) expectTheSameFrom(scenario.dataset(), *result);
    EXPECT_EQ(metrology::subjectOf(scenario.dataset()), "spindle-offset");
  }
  offset.expectHonest();
  stylus.expectHonest();
}

TEST(LiveSpindleOffset, OfAxesThatTurnTogether) {
  Pulls offset;
  for (std::uint64_t seed = 1; seed <= kBallSeeds; ++seed) {
    const auto config = ballWorld(seed);
    Scenario scenario{config, seed};
    const auto result = measured(scenario, procedure::kSpindleOffsetFour);
    ASSERT_TRUE(result);
    add(offset, *result, "offset_C_minus_A_mm", both(truthOf(config).offset), 6e-4);
    if (seed == 1) expectTheSameFrom(scenario.dataset(), *result);
  }
  offset.expectHonest();
}

TEST(LiveLimitedAccess, FindsTheAxisFromAnArc) {
  Pulls centre, ball;
  for (std::uint64_t seed = 1; seed <= kBallSeeds; ++seed) {
    const auto config = ballWorld(seed);
    Scenario scenario{config, seed};
    const auto result = measured(scenario, procedure::kCentrelineLimitedAccess);
    ASSERT_TRUE(result);
    add(centre, *result, "centre_mm", both(truthOf(config).centre), 2e-3);
    // The ball stands near +X at C = 0: a quarter of a turn clockwise from +Y.
    const auto [x_mm, y_mm] = truthOf(config).arm;
    EXPECT_NEAR(std::atan2(x_mm, y_mm), std::numbers::pi / 2, 2e-3);
    add(ball, *result, "psi0_rad", {std::atan2(x_mm, y_mm)}, 1e-3);
    add(ball, *result, "radius_mm", {std::hypot(x_mm, y_mm)}, 2e-3);
    EXPECT_TRUE(result->warnings.empty());
    if (seed == 1) expectTheSameFrom(scenario.dataset(), *result);
    EXPECT_EQ(metrology::subjectOf(scenario.dataset()), "centreline-stylus");
  }
  centre.expectHonest();
  ball.expectHonest();
}

TEST(LiveLimitedAccess, TurnsAsFarAsItIsTold) {
  Scenario scenario{usualWorld(), 2};
  ASSERT_TRUE(measured(scenario, procedure::kCentrelineLimitedAccess, {.arc_rad = 1.0, .angles = 5}));
  const auto& angles = *scenario.dataset().table("readings")->column("C_rad_clockwise_from_plus_y");
  ASSERT_EQ(angles.size(), 6U) << "the first one again, last";
  for (std::size_t i = 0; i < 5; ++i) EXPECT_NEAR(angles[i], 0.5 - 0.25 * static_cast<double>(i), 1e-12);
}

TEST(LivePeriodicCheck, ReadsWhatNeedsNoSwivel) {
  Pulls pulls;
  for (std::uint64_t seed = 1; seed <= kBallSeeds; ++seed) {
    world::Config config = usualWorld();
    const double lower_mm = 1e-4 * static_cast<double>(seed);
    config.part_spindle.point_mm[2] -= lower_mm;
    Scenario scenario{config, seed};
    const auto result = measured(scenario, procedure::kPeriodicCheck);
    ASSERT_TRUE(result);
    const auto truth = truthOf(config);
    add(pulls, *result, "Xcen_B0_mm", {truth.offset[0]}, 6e-4);
    add(pulls, *result, "Ycen_B0_mm", {truth.offset[1]}, 6e-4);
    add(pulls, *result, "z_offset_error_mm", {-lower_mm}, 6e-4);
    EXPECT_EQ(result->find("Ycen_B90_mm"), nullptr);
    EXPECT_EQ(result->find("verdict")->values[0], 0);
    if (seed == 1) expectTheSameFrom(scenario.dataset(), *result);
  }
  pulls.expectHonest();
}

TEST(LivePeriodicCheck, FailsWhereTheMachineHasMoved) {
  world::Config config = usualWorld();
  config.part_spindle.point_mm[1] += 0.03;
  Scenario scenario{config, 3};
  const auto result = measured(scenario, procedure::kPeriodicCheck);
  ASSERT_TRUE(result);
  EXPECT_EQ(result->find("verdict")->values[0], 2);
}

TEST(LiveBallMethods, AreRefusedWithoutADelay) {
  for (const auto* method : {&procedure::kSpindleOffset2x2, &procedure::kSpindleOffsetFour,
                             &procedure::kCentrelineLimitedAccess, &procedure::kPeriodicCheck}) {
    Scenario scenario{usualWorld(), 4};
    scenario.recorder().keeps_bytes = false;
    scenario.run(2s);
    const auto solved = scenario.calibrate(*method);
    ASSERT_TRUE(solved);
    ASSERT_FALSE(solved->ok());
    EXPECT_EQ(solved->error().name, "no-delay");
    EXPECT_EQ(scenario.dataset().table("readings"), nullptr);
  }
}

}  // namespace
}  // namespace probebox::scenario
