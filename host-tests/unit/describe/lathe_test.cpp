// A machine of X and Z alone, and the emulated lathe that is compiled in.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <string>

#include "board/describe/parse.hpp"
#include "board/describe/sim_files.hpp"

namespace probebox::board {
namespace {

using testing::HasSubstr;

std::string latheText() {
  return std::string{simLatheFile("machine.toml")};
}

std::string exchangedInLathe(const std::string& from, const std::string& to) {
  std::string text = latheText();
  const auto at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return text.replace(at, from.size(), to);
}

std::string problemOfLathe(const std::string& text) {
  const auto machine = parseMachine(text, "machine.toml");
  return machine ? "" : machine.error().what;
}

TEST(LatheOfXAndZ, IsDescribedWithoutY) {
  const auto machine = parseMachine(latheText(), "machine.toml");
  ASSERT_TRUE(machine) << machine.error().what;
  EXPECT_FALSE(machine->has_y);
  EXPECT_EQ(machine->axes[1].reference.by, ReferenceBy::absolute) << "it stands at 0";
  EXPECT_FALSE(machine->centreline.correct_y);
  EXPECT_EQ(machine->x_programming, Programming::diameter);
  EXPECT_TRUE(parseMachine(simFile("machine.toml"), "machine.toml")->has_y) << "what is not said is a machine of three";
}

TEST(LatheOfXAndZ, HasNeitherAxisNorScrewNorFaceAlongY) {
  EXPECT_THAT(problemOfLathe(exchangedInLathe("axes = \"XZ\"", "axes = \"XYZ\"")), HasSubstr("axis.Y"));
  EXPECT_THAT(problemOfLathe(exchangedInLathe("[axis.Z]", "[axis.Y]\n[axis.Z]")), HasSubstr("'axis.Y'"));
  EXPECT_THAT(problemOfLathe(exchangedInLathe("[screw.Z]",
                                              "[screw.Y]\nlength_mm = 400\noffset_mm = 120\npitch_mm = 5\n"
                                              "fixed_bearing = \"low\"\ngain = -1.0\ngain_is = \"correction\"\n"
                                              "[screw.Z]")),
              HasSubstr("'screw.Y'"));
  EXPECT_THAT(problemOfLathe(exchangedInLathe("[\"+X\", \"+Z\"]", "[\"+X\", \"+Y\", \"+Z\"]")),
              HasSubstr("'tool.faces'"));
}

TEST(LatheOfXAndZ, IsAnEmulatedBoardOfItsOwn) {
  const auto described = simLatheDescriptions();
  ASSERT_TRUE(described) << described.error().what;
  EXPECT_FALSE(described->machine.has_y);
  EXPECT_EQ(described->box.board_name, "sim") << "its box is that of board/sim";
  ASSERT_TRUE(described->world);
  EXPECT_EQ(described->world->axes.home_mm[1], 0);
}

}  // namespace
}  // namespace probebox::board
