#include <gmock/gmock.h>

#include "board/describe/parse.hpp"
#include "board/describe/sim_files.hpp"
#include "machine_with.hpp"

// What tilts, swivels and carries the probe, and what tools are set on, in machine.toml and in world.toml.
namespace probebox::board {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

TEST(MachineToml, MayDescribeATableThatTilts) {
  EXPECT_FALSE(machineWith("")->tilting_table);
  const auto machine = machineWith("[tilting_table]\naxis = \"-Y\"\ntilts_deg = [-30, 0, 60]\nsigma_rad = 1e-5\n");
  ASSERT_TRUE(machine.ok()) << machine.error().what;
  EXPECT_THAT(machine->tilting_table->axis, testing::ElementsAre(0, -1, 0));
  EXPECT_THAT(machine->tilting_table->angles_deg, testing::ElementsAre(-30, 0, 60));
  EXPECT_EQ(machine->tilting_table->sigma_rad, 1e-5);
  EXPECT_FALSE(machine->tilting_table->point_mm);
  EXPECT_THAT(machineWith("[tilting_table]\naxis = \"X\"\ntilts_deg = [-90, 0]\npoint_mm = [1, 2, 3]\n")
                  ->tilting_table->point_mm.value(),
              testing::ElementsAre(1, 2, 3));
  EXPECT_THAT(machineProblem("[tilting_table]\naxis = \"Z\"\ntilts_deg = [0]\n"),
              AllOf(HasSubstr("tilting_table.axis"), HasSubstr("least 2")));
  EXPECT_THAT(machineProblem("[tilting_table]\naxis = \"X\"\ntilts_deg = [0, 15]\n"), HasSubstr("20 degrees"));
  EXPECT_THAT(machineProblem("[tilting_table]\naxis = \"X\"\ntilts_deg = [0, 90, 0]\n"), HasSubstr("twice"));
  EXPECT_THAT(machineProblem("[tilting_table]\naxis = \"X\"\ntilts_deg = [-180, 90, 180]\n"), HasSubstr("angle twice"));
  EXPECT_THAT(machineProblem("[tilting_table]\naxis = \"X\"\ntilts_deg = [-175, 170]\n"), HasSubstr("20 degrees"));
  EXPECT_TRUE(machineWith("[tilting_table]\naxis = \"X\"\ntilts_deg = [-175, 164]\nsigma_rad = 1e-5\n"));
  EXPECT_THAT(machineProblem("[tilting_table]\naxis = \"X\"\ntilts_deg = [0, 1, 2, 3, 4, 5, 90]\n"),
              HasSubstr("7 values"));
}

TEST(MachineToml, MayDescribeHowWarmTheDatumSphereIs) {
  EXPECT_FALSE(machineWith("[datum_sphere]\ndiameter_mm = 25\n")->datum_sphere_temperature);
  const std::string sphere = "[datum_sphere]\ndiameter_mm = 25\ntemperature_c = 23.5\n";
  const auto machine = machineWith(sphere + "expansion_per_k = 11.5e-6\nsd_temperature_k = 0.5\n");
  ASSERT_TRUE(machine.ok()) << machine.error().what;
  EXPECT_EQ(machine->datum_sphere_temperature->celsius, 23.5);
  EXPECT_EQ(machine->datum_sphere_temperature->sd_k, 0.5);
  EXPECT_EQ(machine->datum_sphere_temperature->expansion_per_k, 11.5e-6);
  const auto of_runs = machineWith("[datum_sphere]\ndiameter_mm = 25\nexpansion_per_k = 1e-5\n");
  ASSERT_TRUE(of_runs.ok()) << of_runs.error().what;
  EXPECT_FALSE(of_runs->datum_sphere_temperature->celsius) << "each run states its own";
  EXPECT_THAT(machineProblem(sphere), HasSubstr("datum_sphere.expansion_per_k"));
  EXPECT_THAT(machineProblem("[datum_sphere]\ndiameter_mm = 25\ntemperature_c = 296\nexpansion_per_k = 1e-5\n"),
              HasSubstr("datum_sphere.temperature_c"));
}

TEST(MachineToml, MayDescribeAHeadThatSwivelsAndToolsThatCarryTheProbe) {
  const auto bare = machineWith("");
  EXPECT_FALSE(bare->swivel_head);
  EXPECT_TRUE(bare->probe_tools.empty());
  const std::string head = "[swivel_head]\naxis = \"Y\"\nangles_deg = [0, 45]\npivot_mm = [0, 0, 60]\n";
  const std::string tools = "[[tool]]\nnumber = 3\nlength_mm = 100\n[[tool]]\nnumber = 5\nlength_mm = 180\n";
  const auto machine =
      machineWith(head + "ball_mm = [1, 2, 3]\nsd_ball_mm = 0.002\n" + tools + "[probe_tools]\nnumbers = [5, 3]\n");
  ASSERT_TRUE(machine.ok()) << machine.error().what;
  EXPECT_THAT(machine->swivel_head->pivot_mm, testing::ElementsAre(0, 0, 60));
  EXPECT_THAT(machine->swivel_head->ball_mm.value(), testing::ElementsAre(1, 2, 3));
  EXPECT_EQ(machine->swivel_head->sd_ball_mm, 0.002);
  ASSERT_EQ(machine->probe_tools.size(), 2U);
  EXPECT_EQ(machine->probe_tools[0].number, 5U);
  EXPECT_EQ(machine->probe_tools[0].length_mm, 180);
  EXPECT_THAT(machineProblem(head + "sd_ball_mm = 0.002\n"), HasSubstr("'ball_mm'"));
  EXPECT_THAT(machineProblem("[swivel_head]\naxis = \"Y\"\nangles_deg = [0, 10]\n"),
              AllOf(HasSubstr("20 degrees"), HasSubstr("swivel_head.pivot_mm")));
  EXPECT_THAT(machineProblem(tools + "[probe_tools]\nnumbers = [3, 4]\n"),
              testing::AllOf(HasSubstr("tool 4"), HasSubstr("[[tool]]")));
  EXPECT_THAT(machineProblem(tools + "[probe_tools]\nnumbers = [3, 3]\n"), HasSubstr("tool 3 twice"));
}

TEST(WorldToml, LeansATableAcrossTheAxisThatItTiltsAbout) {
  const std::string world{simFile("world.toml")};
  const auto with = [&](const std::string& section) {
    const auto begin = world.find("[tilting_table]"), end = world.find("# The head that swivels");
    return parseWorld(world.substr(0, begin) + section + world.substr(end), "world.toml");
  };
  const auto about_y = with("[tilting_table]\naxis = \"-Y\"\npoint_mm = [1, 2, 3]\nlean_x_rad = 1e-4\n");
  ASSERT_TRUE(about_y.ok()) << about_y.error().what;
  EXPECT_THAT(about_y->tilting_table->direction, testing::ElementsAre(1e-4, -1, 0));
  EXPECT_THAT(with("[tilting_table]\naxis = \"X\"\nlean_x_rad = 1e-4\n").error().what,
              AllOf(HasSubstr("lean_x_rad"), HasSubstr("point_mm")));
}

TEST(WorldToml, HasEachToolOnce) {
  const std::string world{simFile("world.toml")};
  const auto twice = parseWorld(world +
                                    "[[probe_spindle.further_tool]]\nnumber = 2\nstylus_offset_x_mm = 0\n"
                                    "stylus_offset_y_mm = 0\nstylus_length_mm = 50\n",
                                "world.toml");
  EXPECT_THAT(twice.error().what, HasSubstr("'probe_spindle.further_tool.number' = 2"));
}

TEST(MachineToml, MayDescribeTheDeviceThatToolsAreSetOn) {
  EXPECT_FALSE(machineWith("")->tool_setter);
  const std::string device =
      "[tool_setter]\ntrigger = \"setter\"\nhalf_width_mm = [8, 7, 6]\nprobe_offset_mm = [0.1, 0, -150]\n";
  const auto machine = machineWith(device + "accepted_mm = [1, 2, 3]\nlimit_mm = 0.05\n");
  ASSERT_TRUE(machine.ok()) << machine.error().what;
  const auto& setter = machine->tool_setter.value();
  EXPECT_EQ(setter.trigger, "setter");
  EXPECT_EQ(setter.half_width_mm[1], 7);
  EXPECT_EQ(setter.probe_offset_mm[2], -150);
  EXPECT_FALSE(setter.sd_probe_offset_mm);
  EXPECT_EQ(setter.accepted_mm.value()[2], 3);
  EXPECT_EQ(setter.limit_mm, 0.05);
  EXPECT_THAT(machineProblem(device + "limit_mm = 0.05\n"), HasSubstr("both or"));
  EXPECT_THAT(machineProblem(device + "sd_accepted_mm = 0.001\n"), HasSubstr("'accepted_mm'"));
  EXPECT_THAT(machineProblem("[tool_setter]\nhalf_width_mm = [8, 0, 6]\nprobe_offset = [0, 0, 1]\n"),
              AllOf(HasSubstr("missing"), HasSubstr("'tool_setter.trigger'"),
                    HasSubstr("'tool_setter.half_width_mm' = 0"), HasSubstr("'tool_setter.probe_offset'")));
}

TEST(MachineToml, MayTellWhatToolsArePutTogetherWith) {
  const std::string holder = "[[holder]]\nnumber = 2\nlength_mm = 62\nsd_mm = 0.001\n";
  const auto machine = machineWith(holder + "[[tool]]\nnumber = 4\nlength_mm = 120\nholder = 2\n");
  ASSERT_TRUE(machine.ok()) << machine.error().what;
  EXPECT_EQ(machine->holders[0].length_mm, 62);
  EXPECT_EQ(machine->tools[0].holder, 2U);
  EXPECT_EQ(machine->tools[0].sd_mm, 0);
  EXPECT_THAT(machineProblem(holder + "[[tool]]\nnumber = 4\nlength_mm = 120\nholder = 3\n"),
              testing::AllOf(HasSubstr("'tool.holder' = 3"), HasSubstr("[[holder]]")));
  EXPECT_THAT(machineProblem(holder + holder), HasSubstr("'holder.number' = 2"));
}

TEST(MachineToml, MayDescribeTheBallOnTheRim) {
  EXPECT_FALSE(machineWith("")->rim_ball);
  const auto machine = machineWith("[rim_ball]\nc_deg = -12.5\nlevel_limit_mm = 0.02\n");
  ASSERT_TRUE(machine.ok()) << machine.error().what;
  EXPECT_EQ(machine->rim_ball->c_deg, -12.5);
  EXPECT_EQ(machine->rim_ball->level_limit_mm.value(), 0.02);
  EXPECT_FALSE(machineWith("[rim_ball]\nc_deg = 0\n")->rim_ball->level_limit_mm);
  const auto contacts = machineWith("[rim_ball]\nc_deg = 0\nbeside_mm = 40\nradius_mm = 600\n");
  ASSERT_TRUE(contacts.ok()) << contacts.error().what;
  EXPECT_EQ(contacts->rim_ball->beside_mm.value(), 40);
  EXPECT_EQ(contacts->rim_ball->radius_mm.value(), 600);
  EXPECT_THAT(machineProblem("[rim_ball]\nc_deg = 0\nbeside_mm = 40\n"), testing::HasSubstr("'rim_ball.radius_mm'"));
  EXPECT_THAT(machineProblem("[rim_ball]\nc_deg = 0\nbeside_mm = 40\nradius_mm = 45\n"),
              testing::AllOf(testing::HasSubstr("0.8"), testing::HasSubstr("radius_mm")));
  EXPECT_THAT(machineProblem("[rim_ball]\nlevel_limit_mm = 0\n"),
              testing::AllOf(testing::HasSubstr("missing"), testing::HasSubstr("'rim_ball.c_deg'"),
                             testing::HasSubstr("'rim_ball.level_limit_mm' = 0")));
}

TEST(TurningTools, NameTheFacesThatTheyReach) {
  const std::string tool = "[[tool]]\nnumber = 7\nlength_mm = 90\nfaces = ";
  const auto machine = machineWith(tool + "[\"+X\", \"-Y\", \"+Z\"]\n");
  ASSERT_TRUE(machine) << machine.error().what;
  EXPECT_EQ(machine->tools.front().faces, 1 + 8 + 16);
  EXPECT_EQ(machineWith("[[tool]]\nnumber = 7\nlength_mm = 90\n")->tools.front().faces, 0) << "all of them";
  EXPECT_THAT(machineProblem(tool + "[\"+X\", \"Z\"]\n"), testing::AllOf(HasSubstr("\"Z\""), HasSubstr("+X")));
  EXPECT_THAT(machineProblem(tool + "[\"+X\", \"+Z\"]\n"), HasSubstr("leaves"));
}

TEST(MachineToml, MayStateWhatResultsHaveToKeep) {
  EXPECT_TRUE(machineWith("")->requirements.empty());
  const auto machine = machineWith(
      "[[requirement]]\nsubject = \"delay\"\nlimit_us = 20\nevery_days = 30\n"
      "[[requirement]]\nsubject = \"rotary-c\"\nlimit_um = 8\nlimit_urad = 40\ncutting_h = 8\ntemperature_k = 5\n");
  ASSERT_TRUE(machine.ok()) << machine.error().what;
  ASSERT_EQ(machine->requirements.size(), 2U);
  EXPECT_EQ(machine->requirements[0].subject, "delay");
  EXPECT_EQ(machine->requirements[0].limit_us, 20);
  EXPECT_EQ(machine->requirements[0].every_days, 30);
  EXPECT_FALSE(machine->requirements[0].limit_um);
  EXPECT_EQ(machine->requirements[1].limit_urad, 40);
  EXPECT_EQ(machine->requirements[1].cutting_h, 8);
  EXPECT_EQ(machine->requirements[1].temperature_k, 5);
  EXPECT_THAT(machineProblem("[[requirement]]\nsubject = \"delay\"\n"), HasSubstr("requirement"));
  EXPECT_THAT(machineProblem("[[requirement]]\nsubject = \"delay\"\nlimit_us = 1\n"
                             "[[requirement]]\nsubject = \"delay\"\nlimit_us = 2\n"),
              HasSubstr("two"));
  EXPECT_THAT(machineProblem("[[requirement]]\nsubject = \"delay\"\nlimit_us = 0\n"), HasSubstr("limit_us"));
}

TEST(SwivelledMeasurements, NeedAHeadThatSwivelsAndTheirOwnAngles) {
  const std::string head = "[swivel_head]\naxis = \"Y\"\nangles_deg = [0, 90]\npivot_mm = [0, 0, 60]\n";
  const std::string setter =
      "[tool_setter]\ntrigger = \"setter\"\nhalf_width_mm = [8, 7, 6]\nprobe_offset_mm = [0.1, 0, -150]\nswivels_deg "
      "= ";
  const auto machine = machineWith(head + setter + "[0, 45, 90]\n");
  ASSERT_TRUE(machine) << machine.error().what;
  EXPECT_EQ(machine->tool_setter->swivels_deg, (std::vector<double>{0, 45, 90}));
  EXPECT_THAT(machineProblem(setter + "[0, 45]\n"), HasSubstr("describe [swivel_head]"));
  EXPECT_THAT(machineProblem(head + setter + "[45, 90]\n"), HasSubstr("rise from"));
  const std::string check = "[periodic_check]\nball_diameter_mm = 12\nball_centre_z_mm = -20\nswivels_deg = ";
  const auto checked = machineWith(head + check + "[90, 0, 45]\n");
  ASSERT_TRUE(checked) << checked.error().what;
  EXPECT_EQ(checked->periodic_check->swivels_deg, (std::vector<double>{45, 90}));
  EXPECT_THAT(machineProblem(head + check + "[30]\n"), HasSubstr("0, 45 and 90"));
  EXPECT_THAT(machineProblem(check + "[90]\n"), HasSubstr("[swivel_head] axis = \"Y\""));
}

}  // namespace
}  // namespace probebox::board
