#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <string>

#include "board/describe/parse.hpp"
#include "board/describe/sim_files.hpp"
#include "machine_with.hpp"

// The sensor head, in machine.toml and in world.toml.
namespace probebox::board {
namespace {

using testing::AllOf;
using testing::HasSubstr;

const std::string kHead = "[sensor_head]\ntool = 5\nrange_mm = 0.4\ncentre_offset_mm = [0.1, 0, -30]\n";

TEST(MachineToml, MayDescribeASensorHead) {
  EXPECT_FALSE(machineWith("")->sensor_head);
  const auto machine = machineWith(kHead + "sd_centre_offset_mm = 0.002\n");
  ASSERT_TRUE(machine.ok()) << machine.error().what;
  const auto& head = machine->sensor_head.value();
  EXPECT_EQ(head.tool, 5U);
  EXPECT_EQ(head.range_mm, 0.4);
  EXPECT_EQ(head.centre_offset_mm[2], -30);
  EXPECT_EQ(head.sd_centre_offset_mm.value(), 0.002);
  EXPECT_FALSE(machineWith(kHead)->sensor_head->sd_centre_offset_mm);
}

TEST(MachineToml, SaysWhatIsWrongWithASensorHead) {
  EXPECT_THAT(machineProblem("[sensor_head]\ntool = 0\nrange_mm = 100\ncentre_offset = [0, 0, 0]\n"),
              AllOf(HasSubstr("'sensor_head.tool' = 0"), HasSubstr("'sensor_head.range_mm' = 100"),
                    HasSubstr("unknown"), HasSubstr("'sensor_head.centre_offset'")));
  const std::string probe_tools = "[probe_tools]\nnumbers = [5]\n[[tool]]\nnumber = 5\nlength_mm = 100\n";
  EXPECT_THAT(machineProblem(probe_tools + kHead),
              AllOf(HasSubstr("'sensor_head.tool' = 5"), HasSubstr("[probe_tools]")));
}

// The emulated board's world, its head described differently.
Outcome<World> worldWithHead(const std::string& head) {
  std::string text{simFile("world.toml")};
  const auto begin = text.find("[sensor_head]"), end = text.find("[rotary_axes]");
  text.replace(begin, end - begin, head);
  return parseWorld(text, "world.toml");
}

constexpr const char* kSensors = "sensors = [[1, 0, 0], [0, 1, 0], [0, 0, 1]]\n";

TEST(WorldToml, MayHaveASensorHead) {
  const std::string head = "[sensor_head]\nnumber = 6\nlength_mm = 170\nrange_mm = 0.4\nnoise_um = 0.1\n";
  EXPECT_FALSE(worldWithHead("")->further_tools.back().head);
  const auto world = worldWithHead(head + kSensors);
  ASSERT_TRUE(world.ok()) << world.error().what;
  const auto& tool = world->further_tools.back();
  EXPECT_EQ(tool.number, 6U);
  EXPECT_EQ(tool.head.value().sensors[2][2], 1);
  EXPECT_EQ(tool.offset_mm[0], 0);
  EXPECT_THAT(worldWithHead(head + "sensors = [[1, 0, 0], [0, 1, 0], [1, 1, 0]]\n").error().what,
              HasSubstr("one plane"));
  EXPECT_THAT(worldWithHead(head).error().what, AllOf(HasSubstr("missing"), HasSubstr("'sensor_head.sensors'")));
  for (const char* other : {"number = 1", "number = 2", "number = 4"}) {
    std::string twice = head + kSensors;
    EXPECT_THAT(worldWithHead(twice.replace(twice.find("number = 6"), 10, other)).error().what, HasSubstr("twice"));
  }
}

}  // namespace
}  // namespace probebox::board
