#include <filesystem>
#include <gtest/gtest.h>

#include "board/describe/parse.hpp"
#include "firmware/app/wiring/daemon.hpp"

// Every board of this tree is one that `probeboxd --check` accepts.
namespace probebox::app {
namespace {

TEST(Boards, OfThisTreePassTheCheck) {
  int boards = 0;
  for (const auto& entry : std::filesystem::directory_iterator{PROBEBOX_BOARDS}) {
    if (!std::filesystem::exists(entry.path() / "box.toml")) continue;
    const auto board = board::loadDirectory(entry.path());
    ASSERT_TRUE(board.ok()) << board.error().what;
    const auto refused = validate(Options{}, *board);
    EXPECT_FALSE(refused) << entry.path() << ": " << refused->what;
    ++boards;
  }
  EXPECT_GE(boards, 3);
}

TEST(Boards, TheWornMachineIsTheEmulatedOneWithTheErrorsThatMachinesHave) {
  const auto worn = board::simDescriptions(std::filesystem::path{PROBEBOX_BOARDS} / "sim-worn");
  ASSERT_TRUE(worn.ok()) << worn.error().what;
  EXPECT_FALSE(validate(Options{}, *worn));
  const auto& world = *worn->world;
  EXPECT_EQ(world.seed, board::simDescriptions()->world->seed);
  for (const double error : {world.axes.lost_motion_mm[0], world.axes.drift.rate_mm_min[0],
                             world.linear_axes.squareness_rad[2], world.linear_axes.scale[0], world.probe.hysteresis_mm,
                             world.probe.lobe_mm, world.probe.curvature, world.probe.drift.rate_mm_min[0]})
    EXPECT_NE(error, 0);
  EXPECT_EQ(world.vibrations.size(), 1U);
  EXPECT_GT(world.screws[0]->heat_shares.size(), 1U);
  EXPECT_EQ(worn->machine.name, board::simDescriptions()->machine.name);
  EXPECT_EQ(worn->machine.accuracy.value().lost_motion_um, 5);
  EXPECT_EQ(board::simDescriptions()->machine.accuracy.value().lost_motion_um, 0);
}

}  // namespace
}  // namespace probebox::app
