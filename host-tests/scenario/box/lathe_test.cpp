#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <random>
#include <string_view>

#include "firmware/metrology/methods.hpp"
#include "firmware/procedure/methods/methods.hpp"
#include "firmware/procedure/plan/readiness.hpp"
#include "host-tests/emulation/scenario.hpp"
#include "host-tests/support/runs.hpp"
#include "measured.hpp"
#include "pulls.hpp"

// A lathe of X and Z alone: the stylus stays in the plane Y = 0, and what it touches stands beside that plane.
namespace probebox::scenario {
namespace {

using procedure::LiveMethod;
using testing::Each;

const std::uint64_t kLatheSeeds = runs(24);

// An axis somewhere else than on the board, a rod that runs out, and a sphere beside the plane of the stylus.
world::Config latheSomewhere(std::uint64_t seed) {
  world::Config config = latheWorld();
  std::mt19937_64 random{seed};
  const auto within = [&](double most) { return std::uniform_real_distribution<double>{-most, most}(random); };
  auto& part = config.part_spindle;
  part.point_mm[0] += within(0.2);
  part.point_mm[1] += within(0.2);
  part.direction[0] += within(2e-4);
  part.direction[1] += within(2e-4);
  for (std::size_t i = 0; i < 2; ++i) part.balls_mm[0][i] += within(0.3);
  config.sphere.centre_mm[1] += within(0.2);
  return config;
}

struct Lathe : Scenario {
  Lathe(const world::Config& config, std::uint64_t seed) : Scenario{config, seed} { facts = latheFacts(); }
};

ProcedureOptions ready(const Scenario& scenario, const LiveMethod& method, const ProcedureOptions& asked = {}) {
  return procedure::readied(method, asked, scenario.facts, {}).value();
}

// X of the true axis at a machine position Z.
double axisAt(const world::Config& config, double z_mm) {
  const auto& part = config.part_spindle;
  return part.point_mm[0] + part.direction[0] / part.direction[2] * (z_mm - part.point_mm[2]);
}

void addDelay(Pulls& pulls, const world::Config& config, std::uint64_t seed) {
  Lathe scenario{config, seed};
  scenario.recorder().keeps_bytes = false;
  scenario.run(std::chrono::seconds{2});
  const auto solved = scenario.calibrate(procedure::kDelayMultiSpeed, ready(scenario, procedure::kDelayMultiSpeed));
  ASSERT_TRUE(solved && solved->ok()) << (solved ? solved->error().reason : "");
  const auto* tau = solved->value().find("tau_s");
  pulls.add(tau->value(), scenario.truth().tau_s[0], tau->sd.at(0));
  EXPECT_EQ(scenario.machine().crashes(), 0U);
}

TEST(LatheOfXAndZ, FindsTheDelayInThePlaneOfItsAxes) {
  Pulls pulls;
  for (std::uint64_t seed = 1; seed <= kLatheSeeds; ++seed) addDelay(pulls, latheSomewhere(seed), seed);
  pulls.expectHonest(Pulls::kCautious);
}

TEST(LatheOfXAndZ, FindsXOfItsTurningAxisAndTheSlopeOverZ) {
  Pulls centre, slope;
  for (std::uint64_t seed = 1; seed <= kLatheSeeds; ++seed) {
    const auto config = latheSomewhere(seed);
    Lathe scenario{config, seed};
    const auto result = measured(scenario, procedure::kCentrelineX, ready(scenario, procedure::kCentrelineX));
    ASSERT_TRUE(result);
    const double z_mm = result->find("mean_z_mm")->value();
    add(centre, *result, "centre_x_mm", {axisAt(config, z_mm)}, 1e-3);
    add(slope, *result, "C_tilt_x_rad", {axisAt(config, 1) - axisAt(config, 0)}, 2e-5);
    EXPECT_THAT(*scenario.dataset().table("machine")->column("y_mm"), Each(0.0));
    if (seed == 1) expectTheSameFrom(scenario.dataset(), *result);
    EXPECT_EQ(metrology::subjectOf(scenario.dataset()), "centreline");
  }
  centre.expectHonest(Pulls::kCautious);
  slope.expectHonest(Pulls::kCautious);
}

// Its ball ends at -Z and is touched from there; the main chuck and its C stay where they are.
TEST(LatheOfXAndZ, FindsTheAxisOfItsSecondChuck) {
  Pulls centre, slope;
  for (std::uint64_t seed = 1; seed <= kLatheSeeds; ++seed) {
    auto config = latheSomewhere(seed);
    std::mt19937_64 random{seed + 500};
    const auto within = [&](double most) { return std::uniform_real_distribution<double>{-most, most}(random); };
    auto& part = *config.second_spindle;
    for (std::size_t i = 0; i < 2; ++i) {
      part.point_mm[i] += within(0.2);
      part.direction[i] += within(2e-4);
      part.balls_mm[0][i] += within(0.3);
    }
    const auto axisOfSecondAt = [&](double z_mm) {
      return part.point_mm[0] + part.direction[0] / part.direction[2] * (z_mm - part.point_mm[2]);
    };
    Lathe scenario{config, seed};
    const auto result =
        measured(scenario, procedure::kCentrelineX, ready(scenario, procedure::kCentrelineX, {.spindle = 2}));
    ASSERT_TRUE(result);
    add(centre, *result, "centre_x_mm", {axisOfSecondAt(result->find("mean_z_mm")->value())}, 1e-3);
    add(slope, *result, "C_tilt_x_rad", {axisOfSecondAt(1) - axisOfSecondAt(0)}, 4e-5);
    EXPECT_EQ(metrology::subjectOf(scenario.dataset()), "centreline-2");
    EXPECT_EQ(scenario.machine().crashes(), 0U);
    EXPECT_EQ(scenario.machine().commandedPose().c_rad, 0) << "the main chuck does not turn";
    if (seed == 1) expectTheSameFrom(scenario.dataset(), *result);
  }
  centre.expectHonest(Pulls::kCautious);
  slope.expectHonest(Pulls::kCautious);
}

TEST(LatheOfXAndZ, TakesASecondChuckOnlyWhereItHasOneAndForATurningAxis) {
  auto facts = latheFacts();
  EXPECT_TRUE(procedure::readied(procedure::kCentrelineX, {.spindle = 2}, facts, {}));
  facts.has_second_spindle = false;
  EXPECT_FALSE(procedure::readied(procedure::kCentrelineX, {.spindle = 2}, facts, {}));
  EXPECT_TRUE(procedure::readied(procedure::kCentrelineX, {.spindle = 1}, facts, {}));
  EXPECT_TRUE(procedure::validate(procedure::kPeriodicCheck, {.spindle = 2}, 1)) << "it would check the main one";
  EXPECT_TRUE(procedure::validate(procedure::kCentrelineX, {.spindle = 3}, 1));
}

TEST(LatheOfXAndZ, KeepsItsAxisWhereTheBallRunsOutByMillimetres) {
  auto config = latheSomewhere(5);
  config.part_spindle.balls_mm[0] = {2.1, -1.4, 60};
  Lathe scenario{config, 5};
  const auto result = measured(scenario, procedure::kCentrelineX, ready(scenario, procedure::kCentrelineX));
  ASSERT_TRUE(result);
  const auto* centre = result->find("centre_x_mm");
  EXPECT_NEAR(centre->value(), axisAt(config, result->find("mean_z_mm")->value()), 4 * centre->sd.at(0));
}

// The ball stands beside the plane of the stylus, where its section is up to some um lower than the ball.
TEST(LatheOfXAndZ, ChecksItsAxisAndTheHeightOfItsBall) {
  Pulls centre, height;
  for (std::uint64_t seed = 1; seed <= kLatheSeeds; ++seed) {
    auto config = latheSomewhere(seed);
    const double lower_mm = 2e-4 * static_cast<double>(seed % 20);
    config.part_spindle.point_mm[2] -= lower_mm;
    Lathe scenario{config, seed};
    const auto result = measured(scenario, procedure::kPeriodicCheck, ready(scenario, procedure::kPeriodicCheck));
    ASSERT_TRUE(result);
    const double height_mm = config.part_spindle.point_mm[2] + config.part_spindle.balls_mm[0][2];
    add(centre, *result, "Xcen_B0_mm", {axisAt(config, height_mm)}, 1e-3);
    add(height, *result, "z_offset_error_mm", {-lower_mm}, 1e-3);
    EXPECT_EQ(result->find("Ycen_B0_mm"), nullptr) << "nothing tells Y";
    EXPECT_EQ(result->find("stylus_offset_x_mm"), nullptr) << "no spindle turns the stylus";
    EXPECT_NEAR(result->find("ball_centre_z_mm")->value(), height_mm, 2e-3);
    if (seed == 1) expectTheSameFrom(scenario.dataset(), *result);
    EXPECT_EQ(metrology::subjectOf(scenario.dataset()), "check");
  }
  centre.expectHonest(Pulls::kCautious);
  height.expectHonest(Pulls::kCautious);
}

TEST(LatheOfXAndZ, FailsTheCheckWhereItsAxisHasMoved) {
  for (const double moved_mm : {0.0, 0.03}) {
    world::Config config = latheWorld();
    config.part_spindle.point_mm[0] += moved_mm;
    Lathe scenario{config, 9};
    const auto result = measured(scenario, procedure::kPeriodicCheck, ready(scenario, procedure::kPeriodicCheck));
    ASSERT_TRUE(result);
    EXPECT_EQ(result->find("verdict")->value(), moved_mm > 0 ? 2 : 0);
    EXPECT_NEAR(result->find("deviation_Xcen_B0_mm")->value(), moved_mm, 2e-3);
  }
}

TEST(LatheOfXAndZ, NeedsTwoAnglesOnly) {
  const auto config = latheSomewhere(6);
  Lathe scenario{config, 6};
  const auto result =
      measured(scenario, procedure::kCentrelineX, ready(scenario, procedure::kCentrelineX, {.angles = 2, .mounts = 1}));
  ASSERT_TRUE(result);
  const auto* centre = result->find("centre_x_mm");
  EXPECT_NEAR(centre->value(), axisAt(config, result->find("mean_z_mm")->value()), 4 * centre->sd.at(0));
  EXPECT_EQ(result->find("C_tilt_x_rad"), nullptr) << "one height has no slope";
}

TEST(LatheOfXAndZ, JogsAndPushesTheAxesThatItHas) {
  Lathe scenario{latheSomewhere(7), 7};
  scenario.run(std::chrono::seconds{2});
  const auto solved = scenario.calibrate(procedure::kSelftest, ready(scenario, procedure::kSelftest));
  ASSERT_TRUE(solved && solved->ok()) << (solved ? solved->error().reason : "");
  EXPECT_EQ(scenario.state().procedure.steps, 4U) << "two jogs, two pushes";
}

TEST(LatheOfXAndZ, SetsATurningToolInXAndZ) {
  Pulls pulls;
  for (std::uint64_t seed = 1; seed <= kLatheSeeds; ++seed) {
    auto config = latheSomewhere(seed);
    std::mt19937_64 random{seed + 1000};
    const auto near = [&](double sd) { return std::normal_distribution<double>{0, sd}(random); };
    auto& tool = toolFour(config);
    tool.offset_mm[0] = *tool.radius_mm + 0.1 * near(1);
    Lathe scenario{config, seed};
    // The probe's offset is stated with its sd.
    scenario.facts.tool_setter->probe_offset_mm[0] = near(0.0005);
    scenario.facts.tool_setter->probe_offset_mm[2] = -60 + near(0.0005);
    const auto result =
        measured(scenario, procedure::kToolSetter, ready(scenario, procedure::kToolSetter, {.tool = 4}));
    ASSERT_TRUE(result);
    // +X is touched by the side of the nose that points to -X.
    add(pulls, *result, "tool_offset_x_mm", {tool.offset_mm[0] - *tool.radius_mm}, 2e-3);
    add(pulls, *result, "tool_offset_z_mm", {-tool.length_mm - *tool.radius_mm}, 2e-3);
    EXPECT_EQ(result->find("tool_offset_mm"), nullptr) << "nothing tells Y";
  }
  pulls.expectHonest(Pulls::kCautious);
}

TEST(LatheOfXAndZ, RefusesWhatNoXAndZTell) {
  const procedure::Facts facts = latheFacts();
  for (const LiveMethod* method : {&procedure::kCentreline, &procedure::kCAxisAlignment, &procedure::kDelayKnownSphere,
                                   &procedure::kSpindleOffset2x2, &procedure::kRotaryAxisErrors}) {
    const auto refused = procedure::readied(*method, {}, facts, {});
    ASSERT_FALSE(refused) << method->name();
    EXPECT_THAT(refused.error().what, testing::HasSubstr(std::string{method->why_no_y})) << method->name();
  }
  EXPECT_FALSE(procedure::readied(procedure::kScrewReference, {.axis = 2}, facts, {})) << "the screw of Y";
  procedure::Facts mill = usualFacts();
  EXPECT_TRUE(procedure::readied(procedure::kCentreline, {}, mill, {}));
}

TEST(LatheOfXAndZ, GivesItsAxisInRadiusAndOnDiameterAndItsYStands) {
  const auto config = latheSomewhere(8);
  Lathe scenario{config, 8};
  const auto result = measured(scenario, procedure::kCentrelineX, ready(scenario, procedure::kCentrelineX));
  ASSERT_TRUE(result);
  const auto activated = result->find("centre_x_mm")->value();
  EXPECT_NEAR(result->find("centre_x_on_diameter_mm")->value(), 2 * activated, 1e-12);
  EXPECT_NEAR(scenario.state().snapshot.axes[1].position_mm, 0, 1e-12);
  EXPECT_TRUE(scenario.state().snapshot.axes[1].referenced);
}

}  // namespace
}  // namespace probebox::scenario
