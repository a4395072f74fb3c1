#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <string>
#include <vector>

#include "board/describe/parse.hpp"
#include "board/describe/sim_files.hpp"

// What the axes and the switch of the emulated machine do wrong, and what goes wrong with it, in world.toml.
namespace probebox::board {
namespace {

using testing::HasSubstr;

Outcome<World> worldWith(const std::string& more) {
  return parseWorld(std::string{simFile("world.toml")} + more, "world.toml");
}

std::string problemWith(const std::string& more) {
  const auto world = worldWith(more);
  EXPECT_FALSE(world.ok()) << more;
  return world.ok() ? "" : world.error().what;
}

TEST(WorldToml, HasStraightAxesAndAScanningProbeUnlessItSaysOtherwise) {
  const auto world = worldWith("");
  ASSERT_TRUE(world.ok()) << world.error().what;
  EXPECT_EQ(world->linear_axes.scale, Vector3{});
  EXPECT_EQ(world->linear_axes.squareness_rad, Vector3{});
  EXPECT_EQ(world->linear_axes.waves[1][2].amplitude_mm, 0);
  EXPECT_FALSE(world->touch_trigger);
}

TEST(WorldToml, DescribesErrorsOfLinearAxesByTheirNamesInISO230) {
  const auto world = worldWith(
      "[linear_axes]\nEC0Y_rad = 2e-5\nEA0Z_rad = -1e-5\n"
      "[linear_axes.EXX]\nscale_um_m = 12\nwave_um = 1.5\nwave_length_mm = 90\nwave_phase_deg = 180\n"
      "[linear_axes.EYX]\nwave_um = 2\n[linear_axes.EXZ]\nwave_um = 3\n");
  ASSERT_TRUE(world.ok()) << world.error().what;
  const auto& axes = world->linear_axes;
  EXPECT_EQ(axes.squareness_rad, (Vector3{-1e-5, 0, 2e-5}));
  EXPECT_DOUBLE_EQ(axes.scale[0], 12e-6);
  EXPECT_DOUBLE_EQ(axes.waves[0][0].amplitude_mm, 0.0015);
  EXPECT_EQ(axes.waves[0][0].length_mm, 90);
  EXPECT_NEAR(axes.waves[0][0].phase_rad, 3.14159265, 1e-8);
  EXPECT_DOUBLE_EQ(axes.waves[0][1].amplitude_mm, 0.002) << "X moves, and the error is along Y";
  EXPECT_DOUBLE_EQ(axes.waves[2][0].amplitude_mm, 0.003);
}

TEST(WorldToml, HasNoneOfTheErrorsOfAWornMachineUnlessItSaysSo) {
  const auto world = worldWith("");
  ASSERT_TRUE(world.ok()) << world.error().what;
  EXPECT_EQ(world->axes.lost_motion_mm, Vector3{});
  EXPECT_EQ(world->axes.drift.rate_mm_min, Vector3{});
  EXPECT_EQ(world->probe.drift.rate_mm_min, Vector3{});
  EXPECT_EQ(world->probe.hysteresis_mm, 0);
  EXPECT_EQ(world->probe.curvature, 0);
  EXPECT_EQ(world->probe.lobe_mm, 0);
  EXPECT_TRUE(world->vibrations.empty());
  EXPECT_EQ(world->screws[0]->heat_shares, std::vector<double>{1});
}

TEST(WorldToml, LikeSimSaysOnlyWhatDiffers) {
  const auto world = parseWorld(
      "like_sim = true\n[axes]\nlost_motion_mm = [0.005, 0.004, 0]\ntraverse_mm_s = 50\n"
      "[probe]\ndrift_mm_min = [0.001, 0, 0]\ndrift_time_constant_s = 600\n[screw.Y]\nheat_shares = [2, 1]\n"
      "[[vibration]]\nof = \"probe\"\nfrequency_hz = 2495\namplitude_um = 0.5\ndirection = [0, 1, 0]\n",
      "world.toml");
  ASSERT_TRUE(world.ok()) << world.error().what;
  const auto sim = worldWith("");
  EXPECT_EQ(world->axes.lost_motion_mm, (Vector3{0.005, 0.004, 0}));
  EXPECT_EQ(world->axes.traverse_mm_s, 50);
  EXPECT_EQ(world->axes.home_mm, sim->axes.home_mm);
  EXPECT_EQ(world->probe.gain, sim->probe.gain);
  EXPECT_EQ(world->probe.drift.rate_mm_min[0], 0.001);
  EXPECT_EQ(world->probe.drift.time_constant_s, 600);
  EXPECT_EQ(world->screws[1]->heat_shares, (std::vector<double>{2, 1}));
  EXPECT_EQ(world->screws[1]->warm_um, sim->screws[1]->warm_um);
  EXPECT_EQ(world->further_tools.size(), sim->further_tools.size());
  ASSERT_EQ(world->vibrations.size(), 1U);
  EXPECT_EQ(world->vibrations[0].of, WorldVibration::Of::probe);
  EXPECT_DOUBLE_EQ(world->vibrations[0].amplitude_mm, 0.0005);
}

TEST(WorldToml, LikeSimIsReadAsStrictly) {
  const auto problem = [](const std::string& more) {
    const auto world = parseWorld("like_sim = true\n" + more, "world.toml");
    EXPECT_FALSE(world.ok()) << more;
    return world.ok() ? std::string{} : world.error().what;
  };
  EXPECT_THAT(problem("[probe]\nhysteresis_um = 1\n"), HasSubstr("world.toml:3"));
  EXPECT_THAT(problem("[screw.Y]\nheat_shares = []\n"), HasSubstr("heat_shares"));
  EXPECT_THAT(problem("[axis]\n"), HasSubstr("axis"));
  EXPECT_FALSE(parseWorld("like_sim = false\n", "world.toml").ok());
}

TEST(WorldToml, NamesAControlOutsideAndWhatItsBTurns) {
  EXPECT_FALSE(worldWith("")->outside_control);
  const auto usual = worldWith("[outside_control]\nport = 7630\n");
  ASSERT_TRUE(usual.ok()) << usual.error().what;
  EXPECT_EQ(usual->outside_control->port, 7630);
  EXPECT_EQ(usual->outside_control->cycle_ns, 1'000'000);
  EXPECT_TRUE(usual->outside_control->b_swivels_head);
  const auto slow = worldWith("[outside_control]\nport = 7630\ncycle_us = 4000\nb_turns = \"table\"\n");
  ASSERT_TRUE(slow.ok()) << slow.error().what;
  EXPECT_EQ(slow->outside_control->cycle_ns, 4'000'000);
  EXPECT_FALSE(slow->outside_control->b_swivels_head);
}

TEST(WorldToml, RefusesAControlOutsideThatTurnsWhatIsNotThere) {
  std::string without{simFile("world.toml")};
  const auto begin = without.find("[tilting_table]");
  without.erase(begin, without.find("\n[", begin) - begin);
  const auto world = parseWorld(without + "[outside_control]\nport = 7630\nb_turns = \"table\"\n", "world.toml");
  ASSERT_FALSE(world.ok());
  EXPECT_THAT(world.error().what,
              testing::AllOf(HasSubstr("'outside_control.b_turns' = \"table\""), HasSubstr("[tilting_table]")));
  EXPECT_THAT(problemWith("[outside_control]\n"), HasSubstr("port"));
  EXPECT_THAT(problemWith("[outside_control]\nport = 70000\n"), HasSubstr("port"));
}

TEST(WorldToml, RefusesWhatNoErrorOfALinearAxisIs) {
  EXPECT_THAT(problemWith("[linear_axes.EYX]\nscale_um_m = 12\n"), HasSubstr("scale_um_m"));
  EXPECT_THAT(problemWith("[linear_axes.EXC]\nwave_um = 1\n"), HasSubstr("EXC"));
  EXPECT_THAT(problemWith("[linear_axes.EXX]\nwave_um = 1\nwave_length_mm = 0\n"), HasSubstr("wave_length_mm"));
  EXPECT_THAT(problemWith("[linear_axes]\nEC0Y_rad = 0.5\n"), HasSubstr("EC0Y_rad"));
}

TEST(WorldToml, MayPutTheBallsOnTheTableInOtherWays) {
  EXPECT_TRUE(worldWith("")->part_spindle.further_mounts.empty());
  const auto world = worldWith("[[part_spindle.further_mount]]\nturn_deg = [0, 0, 180]\nshift_mm = [0, 0, 80]\n");
  ASSERT_TRUE(world.ok()) << world.error().what;
  ASSERT_EQ(world->part_spindle.further_mounts.size(), 1U);
  EXPECT_NEAR(world->part_spindle.further_mounts[0].turn_rad[2], 3.14159265, 1e-8);
  EXPECT_EQ(world->part_spindle.further_mounts[0].shift_mm[2], 80);
  EXPECT_THAT(problemWith("[[part_spindle.further_mount]]\nturn_rad = [0, 0, 1]\n"), HasSubstr("turn_rad"));
}

TEST(WorldToml, MayHaveATouchTriggerProbe) {
  const auto world = worldWith("[touch_trigger]\npre_travel_mm = 0.01\nlate_s = 0.0006\n");
  ASSERT_TRUE(world.ok()) << world.error().what;
  EXPECT_EQ(world->touch_trigger->pre_travel_mm, 0.01);
  EXPECT_EQ(world->touch_trigger->lobe_mm, 0);
  EXPECT_THAT(problemWith("[touch_trigger]\nlobe_mm = 0.01\n"), HasSubstr("pre_travel_mm"));
  EXPECT_THAT(problemWith("[touch_trigger]\npre_travel_mm = 0.01\nchatter_probability = 2\n"),
              HasSubstr("chatter_probability"));
}

TEST(WorldToml, SaysHowMuchASlidingStylusRubs) {
  constexpr std::string_view kKey = "friction = 0.08";
  const std::string world{simFile("world.toml")};
  const auto at = world.find(kKey);
  ASSERT_NE(at, std::string::npos);
  const auto with = [&](std::string_view line) {
    auto changed = world;
    return parseWorld(changed.replace(at, kKey.size(), line), "world.toml");
  };
  EXPECT_EQ(with("friction = 0.2")->probe.friction, 0.2);
  EXPECT_EQ(with("friction = 0")->probe.friction, 0);
  EXPECT_EQ(with("")->probe.friction, 0.08) << "what steel on ruby has, where nothing is said";
  EXPECT_THAT(with("friction = 0.8").error().what, HasSubstr("'probe.friction' = 0.8"));
  EXPECT_THAT(with("friction = -0.1").error().what, HasSubstr("'probe.friction' = -0.1"));
}

TEST(WorldToml, SaysWhatGoesWrongAndWhen) {
  const auto world = worldWith(
      "[[fault]]\nkind = \"screw-sensors-silent\"\nat_s = 60\nlasts_s = 20.5\n"
      "[[fault]]\nkind = \"clock-jumps\"\nat_s = 70\njump_s = -0.0003\n");
  ASSERT_TRUE(world.ok()) << world.error().what;
  ASSERT_EQ(world->faults.size(), 2U);
  EXPECT_EQ(world->faults[0].kind, FaultKind::screw_sensors_silent);
  EXPECT_EQ(world->faults[0].at_s, 60);
  EXPECT_EQ(world->faults[0].lasts_s, 20.5);
  EXPECT_EQ(world->faults[1].kind, FaultKind::clock_jumps);
  EXPECT_EQ(world->faults[1].jump_s, -0.0003);
  EXPECT_TRUE(worldWith("")->faults.empty());
}

TEST(WorldToml, RefusesFaultsThatItCannotMake) {
  EXPECT_THAT(problemWith("[[fault]]\nkind = \"fire\"\nat_s = 1\nlasts_s = 1\n"), HasSubstr("probe-silent"));
  EXPECT_THAT(problemWith("[[fault]]\nkind = \"probe-silent\"\nat_s = 1\n"), HasSubstr("lasts_s"));
  EXPECT_THAT(problemWith("[[fault]]\nkind = \"clock-jumps\"\nat_s = 1\nlasts_s = 1\n"), HasSubstr("jump_s"));
}

}  // namespace
}  // namespace probebox::board
