#include <algorithm>
#include <cmath>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <string>
#include <vector>

#include "drivers/world/random.hpp"
#include "firmware/metrology/methods.hpp"
#include "firmware/procedure/methods/methods.hpp"
#include "firmware/procedure/plan/readiness.hpp"
#include "host-tests/emulation/scenario.hpp"
#include "host-tests/support/runs.hpp"
#include "measured.hpp"
#include "protocol/units/angle.hpp"
#include "pulls.hpp"

// A turning tool reaches one face of the setting device an axis, at B = 0 or with the head swivelled to 45 and 90
// degrees as well, on the emulated machine.
namespace probebox::scenario {
namespace {

using procedure::LiveMethod;
using testing::Contains;
using testing::HasSubstr;
using world::operator*;
using world::operator+;
using world::operator-;
using world::Vector3;

const std::uint64_t kTurningToolSeeds = runs(20);
constexpr std::uint8_t kFaces = 1 + 8 + 16;  // +X, -Y, +Z
constexpr Vector3 kNormals{1, -1, 1};
constexpr double kSdHalfWidth_mm = 4e-4, kSdBall_mm = 6e-4;

// A tool with a nose somewhere near its place; device and stylus ball as uncertain as stated.
world::Config turningToolWorld(std::uint64_t seed) {
  world::Config config = usualWorld();
  world::Random random{seed, 96};
  for (double& at : config.tool_setter->centre_mm) at += random.uniform(-0.03, 0.03);
  auto& tool = toolFour(config);
  for (double& off : tool.offset_mm) off += random.uniform(-0.05, 0.05);
  tool.length_mm += random.uniform(-0.05, 0.05);
  tool.radius_mm = random.uniform(0.1, 0.3);
  tool.nose = true;
  const double wider_mm = kSdHalfWidth_mm * random.normal();
  for (double& half : config.tool_setter->half_width_mm) half += wider_mm;
  config.sphere.stylus_ball_radius_mm += kSdBall_mm / 2 * random.normal();
  return config;
}

// What machine.toml says of the tool, the device and the head.
procedure::Facts factsOf(const std::vector<double>& swivels_rad) {
  auto facts = usualFacts();
  std::ranges::find(facts.tools, 4U, &procedure::ToolFacts::number)->faces = kFaces;
  facts.sd_stylus_ball_diameter_mm = kSdBall_mm;
  auto& setter = *facts.tool_setter;
  setter.sd_half_width_mm = kSdHalfWidth_mm;
  setter.sd_probe_offset_mm.reset();  // its tip is where it is said to be
  setter.swivels_rad = swivels_rad;
  return facts;
}

std::optional<metrology::Result> runToolFour(Scenario& scenario, const LiveMethod& method) {
  const auto options = procedure::described(method, {.tool = 4}, scenario.facts, procedure::ReadBy::tip);
  EXPECT_TRUE(options) << options.error().what;
  return measured(scenario, method, *options);
}

void addWhole(Pulls& pulls, const metrology::Result& result, const char* key, std::size_t row, const Vector3& truth,
              std::size_t count = 3) {
  const auto* found = result.find(key);
  ASSERT_NE(found, nullptr) << key;
  for (std::size_t i = 0; i < count; ++i) {
    const std::size_t k = count * row + i;
    ASSERT_LT(k, found->uncertainty.size());
    EXPECT_LT(found->uncertainty[k], 1.5e-3) << key;
    pulls.add(found->values[k], truth[i], found->uncertainty[k]);
  }
}

// Positions count from where an ideal spindle in a level head would hold the stylus' ball.
Vector3 tipOf(const Scenario& scenario, const world::Config& config, std::uint32_t tool, double b_rad) {
  return scenario.machine().tipIn({.head_rad = b_rad}, tool) - Vector3{0, 0, config.probe_spindle.stylus_length_mm};
}

// The tip of the probe where the nominal head has it.
Vector3 nominalTip(const procedure::Facts& facts, double b_rad) {
  const Vector3 pivot = facts.swivel_head->pivot_mm, arm = facts.tool_setter->probe_offset_mm - pivot;
  return pivot + world::rotation({0, 1, 0}, b_rad) * arm;
}

TEST(TurningTool, IsSetByTheFacesThatItReaches) {
  Pulls tool, device;
  for (std::uint64_t seed = 1; seed <= kTurningToolSeeds; ++seed) {
    const auto config = turningToolWorld(seed);
    Scenario scenario{config, seed};
    scenario.facts = factsOf({});
    const auto result = runToolFour(scenario, procedure::kToolSetter);
    ASSERT_TRUE(result);
    EXPECT_EQ(scenario.state().procedure.steps, 7U * 4U) << "+X, -Y and +Z twice";
    const Vector3 edge = tipOf(scenario, config, 4, 0) - *toolFour(config).radius_mm * kNormals;
    const Vector3 probe = tipOf(scenario, config, 1, 0), nominal = nominalTip(scenario.facts, 0);
    addWhole(tool, *result, "tool_offset_mm", 0, edge + (nominal - probe));
    addWhole(device, *result, "setter_mm", 0,
             config.tool_setter->centre_mm + (nominal - probe) - Vector3{0, 0, config.probe_spindle.stylus_length_mm});
    EXPECT_THAT(result->unobservable, Contains(testing::AllOf(HasSubstr("X and"), HasSubstr("one face"))));
    if (seed == 1) expectTheSameFrom(scenario.dataset(), *result);
  }
  tool.expectHonest();
  device.expectHonest();
}

// The head leans and its pivot is elsewhere: what the machine's geometry does there cancels between probe and tool.
TEST(TurningTool, IsSetAtEveryAngleOfTheHeadAndLinkedToTheTurningAxis) {
  Pulls tool, device, link;
  constexpr std::array kSwivels{0.0, 45 * kDegree, 90 * kDegree};
  for (std::uint64_t seed = 1; seed <= kTurningToolSeeds; ++seed) {
    auto config = turningToolWorld(seed);
    world::Random random{seed, 97};
    for (const std::size_t i : {0U, 2U}) config.swivel_head->pivot_mm[i] += random.uniform(-0.03, 0.03);
    config.swivel_head->noise_rad = 0;
    Scenario scenario{config, seed};
    scenario.facts = factsOf({kSwivels.begin(), kSwivels.end()});
    const Vector3 reference{0, 0, config.probe_spindle.stylus_length_mm};
    // A turning axis that leans, known as well as it is said to be.
    const std::array<double, 2> tilt{2e-4, -1e-4};
    scenario.facts.turning_axis = procedure::TurningAxis{
        .result_id = 5,
        .at_mm = {330 + 5e-4 * random.normal(), 200 + 5e-4 * random.normal()},
        .sd_mm = 5e-4,
        .z_mm = -160,
        .tilt_rad = std::array{tilt[0] + 3e-6 * random.normal(), tilt[1] + 3e-6 * random.normal()},
        .sd_tilt_rad = 3e-6};
    const auto result = runToolFour(scenario, procedure::kToolSetter);
    ASSERT_TRUE(result);
    EXPECT_THAT(result->find("B_deg")->values, testing::ElementsAre(0, 45, 90));
    for (std::size_t k = 0; k < kSwivels.size(); ++k) {
      const Vector3 probe = tipOf(scenario, config, 1, kSwivels[k]), nominal = nominalTip(scenario.facts, kSwivels[k]);
      const Vector3 edge = tipOf(scenario, config, 4, kSwivels[k]) - *toolFour(config).radius_mm * kNormals;
      const Vector3 place = config.tool_setter->centre_mm + (nominal - probe) - reference;
      addWhole(tool, *result, "tool_offset_mm", k, edge + (nominal - probe));
      addWhole(device, *result, "setter_mm", k, place);
      const double up_mm = place[2] + reference[2] + 160;
      addWhole(link, *result, "link_mm", k, {place[0] - 330 - tilt[0] * up_mm, place[1] - 200 - tilt[1] * up_mm, 0}, 2);
    }
    EXPECT_EQ(std::get<double>(scenario.dataset().config.at("centreline_result")), 5);
    if (seed == 1) expectTheSameFrom(scenario.dataset(), *result);
  }
  tool.expectHonest();
  device.expectHonest();
  link.expectHonest();
}

TEST(TurningTool, IsNotSetWhereTheDeviceHasMovedThoughTheHeadSwivels) {
  auto config = turningToolWorld(3);
  config.tool_setter->centre_mm[0] += 0.2;
  Scenario scenario{config, 3};
  scenario.facts = factsOf({0, 45 * kDegree});
  scenario.run(std::chrono::seconds{2});
  scenario.activateDelay(scenario.truth().tau_s);
  const auto options =
      procedure::described(procedure::kToolSetter, {.tool = 4}, scenario.facts, procedure::ReadBy::tip);
  ASSERT_TRUE(options);
  const auto solved = scenario.calibrate(procedure::kToolSetter, *options);
  ASSERT_TRUE(solved && !solved->ok());
  EXPECT_EQ(solved->error().name, "setter-moved");
}

TEST(TurningTool, IsAssembledByTheFacesThatItReaches) {
  Pulls off, length;
  const auto described = factsOf({});
  const auto& unit = *described.tool_setter;
  const auto& holder = std::ranges::find(described.tools, 4U, &procedure::ToolFacts::number)->holder.value();
  for (std::uint64_t seed = 1; seed <= kTurningToolSeeds; ++seed) {
    auto config = turningToolWorld(seed);
    world::Random random{seed, 98};
    config.tool_setter->centre_mm = usualWorld().tool_setter->centre_mm;
    for (double& at : config.tool_setter->centre_mm) at += unit.sd_accepted_mm * random.normal();
    const double true_holder_mm = holder.length_mm + holder.sd_mm * random.normal();
    Scenario scenario{config, seed};
    scenario.facts = described;
    const auto result = runToolFour(scenario, procedure::kToolAssembly);
    ASSERT_TRUE(result);
    const auto& tool = toolFour(config);
    const double nose_mm = *tool.radius_mm;
    addWhole(off, *result, "compensation_mm", 0,
             {-tool.offset_mm[0] + nose_mm, -tool.offset_mm[1] - nose_mm, tool.length_mm + nose_mm - 120});
    addWhole(length, *result, "assembled_length_mm", 0, {tool.length_mm + nose_mm - true_holder_mm}, 1);
    EXPECT_THAT(result->unobservable, Contains(HasSubstr("one face")));
  }
  off.expectHonest();
  length.expectHonest();
}

TEST(TurningTool, NeedsItsFacesWhereTheHeadSwivels) {
  auto facts = factsOf({0, 45 * kDegree});
  std::ranges::find(facts.tools, 4U, &procedure::ToolFacts::number)->faces = 0;
  const auto options = procedure::described(procedure::kToolSetter, {.tool = 4}, facts, procedure::ReadBy::tip);
  ASSERT_FALSE(options);
  EXPECT_THAT(options.error().what, testing::AllOf(HasSubstr("[[tool]]"), HasSubstr("number 4")));
}

}  // namespace
}  // namespace probebox::scenario
