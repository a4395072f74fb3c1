#include <algorithm>
#include <gtest/gtest.h>
#include <random>
#include <string>
#include <vector>

#include "firmware/metrology/methods.hpp"
#include "firmware/modbus/register_image.hpp"
#include "firmware/procedure/methods/methods.hpp"
#include "firmware/procedure/plan/readiness.hpp"
#include "host-tests/emulation/boot.hpp"
#include "host-tests/emulation/register_link.hpp"
#include "host-tests/emulation/scenario.hpp"
#include "host-tests/support/runs.hpp"
#include "host-tests/support/temporary_folder.hpp"
#include "measured.hpp"
#include "pulls.hpp"

// Offsets of the styli of several tools, which a-axis-alignment finds on the emulated machine beside the spindle's
// direction, up to the registers.
namespace probebox::scenario {
namespace {

using namespace std::chrono_literals;
using world::operator*;
using world::operator-;

const std::uint64_t kStylusSeeds = runs(20);

// A spindle that leans some way, styli that hang somewhere.
world::Config styliWorld(std::uint64_t seed) {
  world::Config config = usualWorld();
  std::mt19937_64 random{seed};
  const auto within = [&](double most) { return std::uniform_real_distribution<double>{-most, most}(random); };
  auto& spindle = config.probe_spindle;
  spindle.direction = {within(3e-4), within(3e-4), 1};
  for (double& offset : spindle.stylus_offset_mm) offset = within(0.05);
  for (auto& tool : config.further_tools) {
    for (double& offset : tool.offset_mm) offset = within(0.05);
  }
  return config;
}

// The stylus ball of that tool from the spindle's axis, at A = 0.
std::vector<double> offsetOfTool(const world::Config& config, std::uint32_t number) {
  const auto& spindle = config.probe_spindle;
  auto [x, y] = spindle.stylus_offset_mm;
  double length_mm = spindle.stylus_length_mm;
  for (const auto& tool : config.further_tools) {
    if (tool.number == number) x = tool.offset_mm[0], y = tool.offset_mm[1], length_mm = tool.length_mm;
  }
  const world::Vector3 hanging{x, y, -length_mm}, axis = world::unit(spindle.direction);
  const world::Vector3 off = hanging - world::dot(axis, hanging) * axis;
  return {off[0], off[1]};
}

constexpr const char* kOfFirst = "stylus_offset_of_tool_1_mm";
constexpr const char* kOfSecond = "stylus_offset_of_tool_2_mm";

TEST(LiveStyli, OfAllToolsAreWhereTheSpindlesAlignmentSaysByTheUncertaintyThatItStates) {
  Pulls first, second;
  for (std::uint64_t seed = 1; seed <= kStylusSeeds; ++seed) {
    const auto config = styliWorld(seed);
    Scenario scenario{config, seed};
    const auto result = measured(scenario, procedure::kAAxisAlignment);
    ASSERT_TRUE(result);
    add(first, *result, kOfFirst, offsetOfTool(config, 1), 5e-4);
    add(second, *result, kOfSecond, offsetOfTool(config, 2), 5e-4);
  }
  first.expectHonest();
  second.expectHonest();
}

TEST(LiveStyli, OfTheToolWhoseShankIsTheSecondLength) {
  Pulls pulls;
  for (std::uint64_t seed = 1; seed <= kStylusSeeds; ++seed) {
    const auto config = styliWorld(100 + seed);
    Scenario scenario{config, seed};
    const auto options =
        procedure::described(procedure::kAAxisAlignment, {}, usualFacts(), procedure::ReadBy::shank).value();
    const auto result = measured(scenario, procedure::kAAxisAlignment, options);
    ASSERT_TRUE(result);
    add(pulls, *result, kOfFirst, offsetOfTool(config, 1), 5e-4);
    EXPECT_EQ(result->find(kOfSecond), nullptr);
  }
  pulls.expectHonest();
}

// From one run to three results, each accepted by itself, and to the registers.
TEST(LiveStyli, AreServedByToolOnceAccepted) {
  const support::TemporaryFolder folder;
  const auto config = styliWorld(7);
  Office office{2U << 20U, stream::TriggerHistory::kKept, config};
  Boot boot{office, folder.file("results.db")};
  boot.run(30s);
  ASSERT_NE(boot.start("delay-multi-speed"), 0U);
  const auto delay = boot.finish();
  ASSERT_TRUE(delay && boot.accept(*delay));
  boot.run(1s);
  ASSERT_NE(boot.start("a-axis-alignment"), 0U);
  const auto tilt = boot.finish();
  ASSERT_TRUE(tilt);
  std::vector<std::string> subjects;
  const auto records = boot.calibrations().results(*tilt - 1, 10, 0);
  ASSERT_TRUE(records);
  for (const auto& record : *records) {
    subjects.push_back(record.binding.subject);
    EXPECT_TRUE(boot.accept(record.id)) << record.binding.subject;
  }
  EXPECT_EQ(subjects, (std::vector<std::string>{"spindle-tilt", "stylus-offset-1", "stylus-offset-2"}));

  modbus::RegisterImage image;
  image.fill({}, published::LineState{}, boot.inForce().served(), modbus::WordOrder::high_first);
  RegisterLink controller{{.read =
                               [&](std::uint16_t first, std::size_t count) {
                                 std::vector<std::uint16_t> words;
                                 while (words.size() < count) words.push_back(image[first++]);
                                 return words;
                               },
                           .write = {}}};
  for (const unsigned tool : {1U, 2U}) {
    const auto truth = offsetOfTool(config, tool);
    const auto row = static_cast<std::uint16_t>(5000 + 16 * (tool - 1));
    EXPECT_NEAR(controller.value(row), truth[0], 2e-3) << tool;
    EXPECT_NEAR(controller.value(static_cast<std::uint16_t>(row + 2)), truth[1], 2e-3) << tool;
    EXPECT_GT(image[static_cast<std::uint16_t>(row + 8)], 2) << "sd, 0.01 um";
    EXPECT_LT(image[static_cast<std::uint16_t>(row + 8)], 100);
    const auto in_force = boot.inForce().stylusOffset(tool);
    ASSERT_TRUE(in_force);
    EXPECT_NEAR(in_force->value.values[0], truth[0], 2e-3);
  }
  EXPECT_FALSE(boot.inForce().stylusOffset(3));
}

}  // namespace
}  // namespace probebox::scenario
