#include <algorithm>
#include <cmath>
#include <gtest/gtest.h>
#include <string>
#include <vector>

#include "drivers/world/random.hpp"
#include "firmware/app/results/result_events.hpp"
#include "firmware/app/results/result_values.hpp"
#include "firmware/metrology/methods.hpp"
#include "firmware/procedure/methods/methods.hpp"
#include "host-tests/emulation/scenario.hpp"
#include "host-tests/support/runs.hpp"
#include "measured.hpp"
#include "pulls.hpp"
#include "tools/interference/scene.hpp"

// A tool is set on the device that the probe has measured before, or alone against where that device is known to be, on
// the emulated machine.
namespace probebox::scenario {
namespace {

using namespace std::chrono_literals;
using procedure::LiveMethod;
using world::operator+;
using world::operator-;

const std::uint64_t kSetterSeeds = runs(24);
constexpr ProcedureOptions kTool4{.tool = 4};

// Device, tool and stylus are not quite where the descriptions have them; of the stylus that is as uncertain as stated.
world::Config setterWorld(std::uint64_t seed, double sd_probe_offset_mm) {
  world::Config config = usualWorld();
  world::Random random{seed, 90};
  for (double& at : config.tool_setter->centre_mm) at += random.uniform(-0.03, 0.03);
  auto& tool = toolFour(config);
  for (double& off : tool.offset_mm) off += random.uniform(-0.02, 0.02);
  tool.length_mm += random.uniform(-0.05, 0.05);
  *tool.radius_mm += random.uniform(-0.02, 0.02);
  for (double& off : config.probe_spindle.stylus_offset_mm) off += sd_probe_offset_mm * random.normal();
  config.probe_spindle.stylus_length_mm += sd_probe_offset_mm * random.normal();
  return config;
}

std::vector<double> toolOffset(const world::Config& config) {
  const auto& tool = toolFour(config);
  return {tool.offset_mm[0], tool.offset_mm[1], -tool.length_mm};
}

// Positions are those of the stylus ball under an ideal spindle, and the head's reference is the stylus' length above.
std::vector<double> setterPlace(const world::Config& config) {
  const auto at = config.tool_setter->centre_mm - world::Vector3{0, 0, config.probe_spindle.stylus_length_mm};
  return {at.begin(), at.end()};
}

// In microseconds: a slip of the delay that is in force.
std::optional<metrology::Solved> setOn(Scenario& scenario, double wrong_delay_us = 0,
                                       const LiveMethod& method = procedure::kToolSetter) {
  scenario.recorder().keeps_bytes = false;
  scenario.run(2s);
  auto tau_s = scenario.truth().tau_s;
  for (double& tau : tau_s) tau += 1e-6 * wrong_delay_us;
  scenario.activateDelay(tau_s);
  auto solved = scenario.calibrate(method, kTool4);
  EXPECT_TRUE(solved) << "did not end";
  EXPECT_EQ(scenario.machine().crashes(), 0U);
  return solved;
}

TEST(LiveToolSetter, FindsToolAndDeviceAsWellAsItSays) {
  Pulls tool, device;
  for (std::uint64_t seed = 1; seed <= kSetterSeeds; ++seed) {
    const auto config = setterWorld(seed, usualFacts().tool_setter->sd_probe_offset_mm.value());
    Scenario scenario{config, seed};
    const auto solved = setOn(scenario);
    ASSERT_TRUE(solved && solved->ok()) << solved->error().reason;
    const auto& result = solved->value();
    add(tool, result, "tool_offset_mm", toolOffset(config), 1e-3);
    add(device, result, "setter_mm", setterPlace(config), 1e-3);
    EXPECT_EQ(result.dof, 15U) << "three rounds with the probe, three with the tool, and the probe once more";
    EXPECT_TRUE(result.warnings.empty()) << result.warnings.front();
    EXPECT_EQ(scenario.machine().stylus().contactCount(), scenario.state().procedure.steps) << "each step touches once";
    EXPECT_EQ(scenario.machine().tool(), 1U) << "the probe closes the run";
  }
  tool.expectHonest();
  device.expectHonest();
}

// Along Z the tool is known from one face, and the ball is between device and probe there.
TEST(LiveToolSetter, CountsTheStatedUncertaintyOfTheStylusBallAlongZAlone) {
  constexpr double kSdBall_mm = 2e-3;
  std::vector<metrology::Result> results;
  for (const bool stated : {false, true}) {
    Scenario scenario{setterWorld(2, 0), 2};
    if (stated) scenario.facts.sd_stylus_ball_diameter_mm = kSdBall_mm;
    const auto solved = setOn(scenario);
    ASSERT_TRUE(solved && solved->ok()) << solved->error().reason;
    results.push_back(solved->value());
    if (stated) expectTheSameFrom(scenario.dataset(), results.back());
  }
  for (const char* key : {"tool_offset_mm", "setter_mm"}) {
    const auto& exact = *results[0].find(key);
    const auto& stated = *results[1].find(key);
    const auto exact_mm = app::uncertaintiesOf(exact), stated_mm = app::uncertaintiesOf(stated);
    for (std::size_t i = 0; i < 3; ++i) {
      EXPECT_NEAR(stated.values[i], exact.values[i], 1e-9) << key;
      EXPECT_NEAR(stated_mm[i], std::hypot(exact_mm[i], i == 2 ? kSdBall_mm / 2 : 0), 1e-7) << key << " " << i;
    }
  }
}

// The touches alone, where the probe is known exactly: what is stated for them must hold without it.
TEST(LiveToolSetter, KnowsHowWellItTouches) {
  Pulls tool, device;
  for (std::uint64_t seed = 1; seed <= kSetterSeeds; ++seed) {
    const auto config = setterWorld(seed, 0);
    Scenario scenario{config, seed};
    ASSERT_TRUE(setOn(scenario));
    auto dataset = scenario.dataset();
    dataset.config.erase("sd_probe_offset_mm");
    auto solved = metrology::solve(dataset);
    ASSERT_TRUE(solved) << solved.error().reason;
    add(tool, *solved, "tool_offset_mm", toolOffset(config), 4e-4);
    add(device, *solved, "setter_mm", setterPlace(config), 4e-4);
  }
  tool.expectHonest();
  device.expectHonest();
}

TEST(LiveToolSetter, DependsNeitherOnTheDelayNorOnHowLateTheDeviceIs) {
  struct Lag {
    double of_device_s, wrong_delay_us;
  };
  std::vector<metrology::Result> results;
  for (const auto& lag : {Lag{0, 0}, Lag{0.003, 0}, Lag{0.0004, 800}}) {
    auto config = setterWorld(3, 0);
    config.tool_setter->late_s = lag.of_device_s;
    Scenario scenario{config, 3};
    const auto solved = setOn(scenario, lag.wrong_delay_us);
    ASSERT_TRUE(solved && solved->ok());
    results.push_back(solved->value());
    // What the edges are late by beside the probe's samples, as far as the delay in force is right.
    const auto& late_s = *scenario.dataset().table("contacts")->column("late_s");
    double mean_s = 0;
    for (const double late : late_s) mean_s += late / static_cast<double>(late_s.size());
    const double of_kernel_s = 25e-6;
    EXPECT_NEAR(mean_s, lag.of_device_s + of_kernel_s + 1e-6 * lag.wrong_delay_us - scenario.truth().tau_probe_s, 2e-5);
  }
  for (const auto& result : results) {
    for (const char* key : {"tool_offset_mm", "setter_mm"}) {
      for (std::size_t i = 0; i < 3; ++i)
        EXPECT_NEAR(result.find(key)->values[i], results[0].find(key)->values[i], 5e-4) << key;
    }
  }
}

TEST(LiveToolSetter, IsSavedWithEveryDigit) {
  Scenario scenario{setterWorld(1, 0), 1};
  const auto solved = setOn(scenario);
  ASSERT_TRUE(solved && solved->ok());
  EXPECT_EQ(metrology::subjectOf(scenario.dataset()), "tool-4") << "another tool's offset stays in force beside it";
  expectTheSameFrom(scenario.dataset(), solved->value());
}

TEST(LiveToolSetter, NoticesADeviceThatHasMovedOrIsAnotherOne) {
  auto moved = usualWorld();
  moved.tool_setter->centre_mm[1] += 0.15;
  Scenario elsewhere{moved, 5};
  const auto far = setOn(elsewhere);
  ASSERT_TRUE(far && !far->ok());
  EXPECT_EQ(far->error().name, "setter-moved");

  auto wider = usualWorld();
  wider.tool_setter->half_width_mm[0] += 0.1;
  Scenario other{wider, 5};
  const auto wide = setOn(other);
  ASSERT_TRUE(wide && !wide->ok());
  EXPECT_EQ(wide->error().name, "setter-width-wrong");
  EXPECT_NE(wide->error().reason.find("along X"), std::string::npos) << wide->error().reason;
}

TEST(LiveToolSetter, IsRefusedWithoutADelay) {
  Scenario scenario{usualWorld(), 4};
  scenario.recorder().keeps_bytes = false;
  scenario.run(2s);
  const auto solved = scenario.calibrate(procedure::kToolSetter, kTool4);
  ASSERT_TRUE(solved && !solved->ok());
  EXPECT_EQ(solved->error().name, "no-delay");
}

TEST(LiveToolSetter, AsksAgainWhereTheDeviceSaysNothing) {
  auto config = usualWorld();
  config.tool_setter->centre_mm[2] -= 30;  // every way goes past it
  Scenario scenario{config, 6};
  scenario.recorder().keeps_bytes = false;
  scenario.run(2s);
  scenario.activateDelay(scenario.truth().tau_s);
  scenario.start(procedure::kToolSetter, kTool4);
  ASSERT_TRUE(scenario.runUntil([&] { return scenario.state().procedure.state == procedure::State::refused; }, 60s));
  EXPECT_EQ(scenario.state().procedure.last_fault, capture::TouchFault::no_edges);
}

TEST(LiveToolSetter, LeavesTheProbeToTheMethodThatComesAfter) {
  Scenario scenario{usualWorld(), 7};
  ASSERT_TRUE(setOn(scenario));
  const auto solved = scenario.calibrate(procedure::kDelayKnownSphere);
  ASSERT_TRUE(solved && solved->ok());
  EXPECT_EQ(scenario.machine().tool(), 1U);
  EXPECT_LT(std::abs(solved->value().find("tau_s")->values[0] - scenario.truth().tau_s[0]),
            5 * solved->value().find("tau_s")->sd[0]);
}

// The holder's length and the place of the unit are what machine.toml has, as uncertain as it says.
TEST(LiveToolAssembly, FindsWhatTheToolIsOffAsWellAsItSays) {
  const auto facts = usualFacts();
  const auto& unit = facts.tool_setter.value();
  const auto& holder = std::ranges::find(facts.tools, 4U, &procedure::ToolFacts::number)->holder.value();
  Pulls off, length;
  for (std::uint64_t seed = 1; seed <= kSetterSeeds; ++seed) {
    auto config = setterWorld(seed, 0);
    world::Random random{seed, 91};
    config.tool_setter->centre_mm = usualWorld().tool_setter->centre_mm;
    for (double& at : config.tool_setter->centre_mm) at += unit.sd_accepted_mm * random.normal();
    const double true_holder_mm = holder.length_mm + holder.sd_mm * random.normal();
    Scenario scenario{config, seed};
    const auto solved = setOn(scenario, 0, procedure::kToolAssembly);
    ASSERT_TRUE(solved && solved->ok()) << solved->error().reason;
    const auto& tool = toolFour(config);
    add(off, solved->value(), "compensation_mm", {-tool.offset_mm[0], -tool.offset_mm[1], tool.length_mm - 120}, 1e-3);
    add(length, solved->value(), "assembled_length_mm", {tool.length_mm - true_holder_mm}, 2e-3);
    EXPECT_EQ(scenario.machine().stylus().contactCount(), 18U) << "each step touches once";
    EXPECT_TRUE(solved->value().warnings.empty()) << solved->value().warnings.front();
  }
  off.expectHonest();
  length.expectHonest();
}

// What a simulation draws, and what a control has to add: the place of the world's tip decides both.
TEST(LiveToolAssembly, PutsTheTipWhereItIsAndTheMotionWhereItBelongs) {
  auto config = setterWorld(4, 0);
  config.tool_setter->centre_mm = usualWorld().tool_setter->centre_mm;
  Scenario scenario{config, 4};
  const auto solved = setOn(scenario, 0, procedure::kToolAssembly);
  ASSERT_TRUE(solved && solved->ok());
  const auto& w2 = solved->value().find("compensation_mm")->values;
  const auto& off = toolFour(config).offset_mm;
  board::CellTool cell;
  cell.w1_mm = {{w2[0], w2[1]}};
  const auto drawn = interference::lengthsOf(cell).tip_mm;
  const auto set = setOn(scenario);
  ASSERT_TRUE(set && set->ok());
  const auto& setter = set->value().find("tool_offset_mm")->values;
  for (std::size_t k = 0; k < 2; ++k) {
    ASSERT_GT(std::abs(off[k]), 0.0025) << "or a sign would not show";
    EXPECT_NEAR(drawn[k], off[k], 3e-3) << "the tip from the axis";
    EXPECT_NEAR(setter[k], off[k], 2e-3) << "as the tool-setter has it";
    constexpr double kCommanded_mm = 100;
    const double tip_mm = kCommanded_mm + w2[k] + off[k];
    EXPECT_NEAR(tip_mm, kCommanded_mm, 3e-3) << "with W2 added";
  }
}

// L0 - g is the length from the gauge line: the unit's size counts in it as in the compensation along Z.
TEST(LiveToolAssembly, KnowsTheLengthFromTheGaugeLineAsWellAsTheCompensation) {
  Scenario scenario{setterWorld(2, 0), 2};
  const auto solved = setOn(scenario, 0, procedure::kToolAssembly);
  ASSERT_TRUE(solved && solved->ok());
  const auto* length = solved->value().find("gauge_length_mm");
  ASSERT_TRUE(length != nullptr);
  EXPECT_NEAR(length->sd[0], solved->value().find("compensation_mm")->sd[2], 1e-9);
}

TEST(LiveToolAssembly, IsSavedWithEveryDigitAndWithWhatGoesBackToTheStores) {
  Scenario scenario{setterWorld(2, 0), 2};
  const auto solved = setOn(scenario, 0, procedure::kToolAssembly);
  ASSERT_TRUE(solved && solved->ok());
  EXPECT_EQ(metrology::subjectOf(scenario.dataset()), "assembly-4");
  const auto also = [&](const char* key) {
    return *std::ranges::find(solved->value().also, std::string{key}, &metrology::Estimate::key);
  };
  EXPECT_EQ(also("tool_id").value(), 4);
  EXPECT_EQ(also("holder_id").value(), 1);
  EXPECT_EQ(also("simulation_mm").values[2], solved->value().find("assembled_length_mm")->value());
  EXPECT_EQ(also("motion_control_mm").values, solved->value().find("compensation_mm")->values);
  expectTheSameFrom(scenario.dataset(), solved->value());
}

}  // namespace
}  // namespace probebox::scenario
