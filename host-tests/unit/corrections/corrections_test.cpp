#include "firmware/corrections/corrections.hpp"

#include <gtest/gtest.h>
#include <utility>

#include "machine_on_a_desk.hpp"
#include "protocol/units/angle.hpp"

namespace probebox::corrections {
namespace {

constexpr TickMap kLocked{
    .tick = {}, .at = {}, .period_q32_ns = 0, .sigma_ns = 400, .state = ClockState::locked, .holdover_ms = 0};

TEST(Corrections, StartInvalid) {
  Corrections corrections{{}};
  corrections.advance(monoTime(0), TickMap{}, {});
  EXPECT_FALSE(corrections.state().valid);
  EXPECT_FALSE(corrections.state().delay.calibrated);
  EXPECT_FALSE(corrections.state().clock_locked);
}

TEST(Corrections, OfScrewsThatAreNotThereAreNotValid) {
  Corrections corrections{{}};
  corrections.push(SourcesEnabled{.mask = bitOf(SourceKind::screw), .at = monoTime(0)});
  for (int ms = 1; ms < 100; ++ms) corrections.advance(monoTime(ms * 1'000'000), kLocked, {});
  EXPECT_FALSE(corrections.state().valid);
  EXPECT_EQ(corrections.state().heartbeat, 0U);
}

TEST(Corrections, CarryTheDelayInForceAndSeeThatSamplesWereLost) {
  Corrections corrections{{}};
  corrections.push(DelayActivated{.result_id = 5, .tau_s = {1e-3, 2e-3, 3e-3}, .sd_s = {1e-6, 1e-6, 2e-6}, .at = {}});
  corrections.advance(monoTime(0), kLocked, {.produced = 100, .lost_at_source = 0, .lost_in_queue = 0});
  EXPECT_TRUE(corrections.state().delay.calibrated);
  EXPECT_EQ(corrections.state().delay.tau_s[2], 3e-3);
  EXPECT_FALSE(corrections.state().loss_seen);
  corrections.advance(monoTime(1), kLocked, {.produced = 200, .lost_at_source = 0, .lost_in_queue = 1});
  EXPECT_TRUE(corrections.state().loss_seen);
  corrections.push(DelayActivated{});
  EXPECT_FALSE(corrections.state().delay.calibrated) << "rolled back to none";
}

// Told by the controller > measured > described.
TEST(Corrections, TakeTheLengthOfAToolFromWhoKnowsItBest) {
  CorrectionsConfig config;
  config.tools = {.count = 1, .lengths = {{{.number = 4, .length_mm = 150}}}};
  Corrections corrections{config};
  auto length_mm = [&corrections, now = 0]() mutable {
    corrections.advance(monoTime(++now), kLocked, {});
    return corrections.state().swivel.tool_length_mm;
  };
  PoseTold pose{.axes = 0, .angles_rad = {}, .has_tool = true, .tool = 4, .tool_length_mm = 0, .at = {}};
  corrections.push(pose);
  using enum published::ValueSource;
  const auto& said = corrections.state().swivel;
  EXPECT_EQ(length_mm(), 150) << "machine.toml";
  EXPECT_EQ(said.tool_length_from, description);
  corrections.push(ToolLengthActivated{.result_id = 7, .tool = 4, .length_mm = 150.25, .at = {}});
  EXPECT_EQ(length_mm(), 150.25) << "the tool that is in the spindle already";
  EXPECT_EQ(said.tool_length_from, result);
  EXPECT_EQ(said.tool_length_result, 7U);
  corrections.push(ToolLengthActivated{.result_id = 8, .tool = 5, .length_mm = 90, .at = {}});
  EXPECT_EQ(length_mm(), 150.25) << "another tool";
  pose.tool_length_mm = 151;
  corrections.push(pose);
  EXPECT_EQ(length_mm(), 151) << "the controller";
  EXPECT_EQ(said.tool_length_from, controller);
  EXPECT_EQ(said.tool_length_result, 0U);
  pose.tool_length_mm = 0;
  pose.tool = 5;
  corrections.push(pose);
  EXPECT_EQ(length_mm(), 90) << "measured, and not described";
  pose.tool = 4;
  corrections.push(pose);
  corrections.push(ToolLengthActivated{.result_id = 0, .tool = 4, .length_mm = 0, .at = {}});
  EXPECT_EQ(length_mm(), 150) << "rolled back";
  EXPECT_EQ(said.tool_length_from, description);
  pose.tool = 9;
  corrections.push(pose);
  EXPECT_EQ(length_mm(), 0) << "nobody knows that tool";
  EXPECT_EQ(said.tool_length_from, unknown);
  // A length that is withdrawn gives its place to another one.
  for (std::uint32_t tool = 100; tool < 100 + kMostMeasuredTools; ++tool) {
    corrections.push(ToolLengthActivated{.result_id = tool, .tool = tool, .length_mm = 60, .at = {}});
    corrections.push(ToolLengthActivated{.result_id = 0, .tool = tool, .length_mm = 0, .at = {}});
  }
  corrections.push(ToolLengthActivated{.result_id = 9, .tool = 9, .length_mm = 70, .at = {}});
  EXPECT_EQ(length_mm(), 70);
  pose.tool = 5;
  corrections.push(pose);
  EXPECT_EQ(length_mm(), 90) << "the others stay";
}

// A machine whose only screw is that of this axis.
TEST(Corrections, WaitForTheReferencesOfTheAxesThatTheyNeedAndForNoOther) {
  for (const auto axis : {Axis::x, Axis::y, Axis::z}) {
    auto config = MachineOnADesk::usual();
    std::swap(config.screws[0], config.screws.at(static_cast<std::size_t>(axis)));
    MachineOnADesk machine{config};
    machine.run(0.5);
    for (const auto other : {Axis::x, Axis::y, Axis::z}) {
      if (other == axis) continue;
      machine.corrections.push(AxisHomed{other, machine.position_mm.at(static_cast<std::size_t>(other)), machine.now});
    }
    machine.run(0.1);
    EXPECT_FALSE(machine.snapshot().referenced) << static_cast<int>(axis);
    MachineOnADesk alone{config};
    alone.run(0.5);
    alone.corrections.push(AxisHomed{axis, alone.position_mm.at(static_cast<std::size_t>(axis)), alone.now});
    alone.run(0.1);
    EXPECT_TRUE(alone.snapshot().referenced) << static_cast<int>(axis);
  }
}

// The axis may be anywhere, whatever its latest count was.
TEST(Corrections, TakeNoReferenceForAnAxisWhoseEncoderIsSilent) {
  MachineOnADesk machine{MachineOnADesk::usual()};
  machine.position_mm = {10, 10, 10};
  machine.run(0.5);
  machine.home();
  machine.encoders = false;
  machine.run(0.1);
  machine.position_mm = {50, 50, 50};
  machine.run(1);
  machine.home();
  machine.run(0.01);
  EXPECT_EQ(machine.snapshot().refused_homings, 3U);
  machine.encoders = true;
  machine.run(0.05);
  EXPECT_TRUE(machine.snapshot().axes[0].referenced);
  EXPECT_NEAR(machine.snapshot().axes[0].position_mm, 50, 1e-6);
  machine.run(0.2);
  machine.home();
  machine.run(0.01);
  EXPECT_EQ(machine.snapshot().refused_homings, 3U) << "it is counted again, and stands still";
}

TEST(Corrections, TakeNoAngleForARotaryAxisWhoseEncoderIsSilent) {
  auto config = MachineOnADesk::usual();
  config.angles[2] = {.described = true,
                      .from = AngleFrom::encoder,
                      .reference = {.by = ReferenceBy::homing, .mm_per_count = MachineOnADesk::kDegPerCount}};
  MachineOnADesk machine{config};
  const auto told = [&machine](double degrees) {
    machine.corrections.push(PoseTold{.axes = 4,
                                      .angles_rad = {0, 0, degrees * kDegree},
                                      .has_tool = false,
                                      .tool = 0,
                                      .tool_length_mm = 0,
                                      .at = machine.now});
  };
  machine.angle_deg[2] = 10;
  machine.run(0.5);
  told(10);
  machine.angle_deg[2].reset();
  machine.run(1);
  told(50);
  machine.angle_deg[2] = 50;
  machine.run(0.05);
  EXPECT_TRUE(machine.snapshot().rotary[2].known);
  EXPECT_NEAR(machine.snapshot().rotary[2].angle_rad, 50 * kDegree, 1e-6);
}

// C turns for a while, and its controller tells it from 0 to 360 degrees.
published::RotaryAxisState turned(bool wraps, double speed_deg_s, double maximum_speed_deg_s) {
  auto config = MachineOnADesk::usual();
  config.angles[2] = {.described = true,
                      .from = AngleFrom::encoder,
                      .reference = {.by = ReferenceBy::homing,
                                    .mm_per_count = -MachineOnADesk::kDegPerCount,
                                    .maximum_speed_mm_s = maximum_speed_deg_s},
                      .wraps = wraps};
  MachineOnADesk machine{config};
  machine.angle_deg[2] = 350;
  machine.run(0.5);
  machine.corrections.push(PoseTold{
      .axes = 4, .angles_rad = {0, 0, 0}, .has_tool = false, .tool = 0, .tool_length_mm = 0, .at = machine.now});
  for (int i = 0; i < 10'000; ++i) {
    const double angle_deg = *machine.angle_deg[2] + speed_deg_s * 1e-3;
    machine.angle_deg[2] = angle_deg - 360 * std::floor(angle_deg / 360);
    machine.tick();
  }
  return machine.snapshot().rotary[2];
}

TEST(Corrections, FollowARotaryAxisWhoseCountsBeginAgainWithEachTurn) {
  for (const double speed_deg_s : {90.0, -90.0}) {
    for (const double maximum_speed_deg_s : {100.0, 1e6}) {
      const auto c = turned(true, speed_deg_s, maximum_speed_deg_s);
      EXPECT_TRUE(c.known);
      EXPECT_EQ(c.reference_losses, 0U);
      EXPECT_NEAR(c.angle_rad / kDegree, -10 * speed_deg_s, 0.01);
    }
  }
  EXPECT_FALSE(turned(false, 90, 100).known) << "no counter of an encoder does that";
}

TEST(Corrections, AreRefusedASourceThatTheMachineDoesNotHave) {
  CorrectionsConfig config;
  config.mask = bitOf(SourceKind::screw);
  const auto refused = validate(config);
  ASSERT_TRUE(refused);
  EXPECT_NE(refused->what.find("[screw.X]"), std::string::npos);
}

}  // namespace
}  // namespace probebox::corrections
