#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <string>

#include "board/describe/parse.hpp"
#include "board/describe/sim_files.hpp"
#include "machine_with.hpp"

// The shank above the stylus' ball, in machine.toml and in world.toml.
namespace probebox::board {
namespace {

using testing::HasSubstr;

std::string shank(const std::string& tool, double from_mm, double to_mm, double height_mm) {
  return "[[tool]]\nnumber = 1\nlength_mm = 150\n[probe_shank]\ntool = " + tool +
         "\nradius_mm = 5\nfrom_mm = " + std::to_string(from_mm) + "\nto_mm = " + std::to_string(to_mm) +
         "\nheight_mm = " + std::to_string(height_mm) + "\n";
}

TEST(MachineToml, MayDescribeTheShankOfTheStylus) {
  EXPECT_FALSE(machineWith("")->probe_shank);
  const auto machine = machineWith(shank("1", 30, 90, 60));
  ASSERT_TRUE(machine.ok()) << machine.error().what;
  const auto& described = machine->probe_shank.value();
  EXPECT_EQ(described.tool, 1U);
  EXPECT_EQ(described.radius_mm, 5);
  EXPECT_EQ(described.from_mm, 30);
  EXPECT_EQ(described.to_mm, 90);
  EXPECT_EQ(described.height_mm, 60);
}

TEST(MachineToml, SaysWhereThereIsNoShankToTouchWith) {
  for (const double height_mm : {29.0, 30.5, 89.5, 100.0})
    EXPECT_THAT(machineProblem(shank("1", 30, 90, height_mm)), HasSubstr("'probe_shank.height_mm'"));
  EXPECT_THAT(machineProblem(shank("1", 5, 90, 9)), HasSubstr("'probe_shank.height_mm' = 9"));
  EXPECT_THAT(machineProblem(shank("1", 90, 30, 60)), testing::AllOf(HasSubstr("to_mm'"), HasSubstr("'from_mm'")));
  EXPECT_THAT(machineProblem(shank("1", 30, 151, 60)), HasSubstr("tool 1"));
  EXPECT_THAT(machineProblem(shank("3", 30, 90, 60)),
              testing::AllOf(HasSubstr("'probe_shank.tool' = 3"), HasSubstr("[[tool]]")));
}

// The emulated board's world, its shank described differently.
Outcome<World> worldWithShank(const std::string& shank) {
  std::string text{simFile("world.toml")};
  const auto begin = text.find("[probe_spindle.shank]"), end = text.find("[[probe_spindle.further_tool]]");
  text.replace(begin, end - begin, shank);
  return parseWorld(text, "world.toml");
}

TEST(WorldToml, MayHaveAShank) {
  EXPECT_FALSE(worldWithShank("")->probe_spindle.shank);
  const auto world =
      worldWithShank("[probe_spindle.shank]\nradius_mm = 4\nfrom_mm = 20\nto_mm = 70\nlean_x_rad = 0.001\n");
  ASSERT_TRUE(world.ok()) << world.error().what;
  const auto& shank = world->probe_spindle.shank.value();
  EXPECT_EQ(shank.radius_mm, 4);
  EXPECT_EQ(shank.lean[0], 0.001);
  EXPECT_EQ(shank.offset_mm[1], 0);
  EXPECT_EQ(shank.lever, 1);
  EXPECT_THAT(worldWithShank("[probe_spindle.shank]\nradius_mm = 4\nfrom_mm = 70\nto_mm = 20\n").error().what,
              testing::AllOf(HasSubstr("to_mm'"), HasSubstr("'from_mm'")));
  EXPECT_THAT(worldWithShank("[probe_spindle.shank]\nradius_mm = 4\nfrom_mm = 20\n").error().what,
              testing::AllOf(HasSubstr("missing"), HasSubstr("'probe_spindle.shank.to_mm'")));
}

}  // namespace
}  // namespace probebox::board
