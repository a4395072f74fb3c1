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

TEST(Boards, BeagleBoneReadsItsAxesInTwoWays) {
  const auto board = board::loadDirectory(std::filesystem::path{PROBEBOX_BOARDS} / "beaglebone");
  ASSERT_TRUE(board.ok()) << board.error().what;
  const auto& encoders = board->box.devices.encoders_by_axis;
  for (std::size_t axis = 0; axis < board::kLinearEncoders; ++axis) {
    ASSERT_TRUE(encoders.at(axis));
    EXPECT_EQ(board::kindOf(*encoders.at(axis)), "counter");
  }
  ASSERT_TRUE(encoders.at(5));
  EXPECT_EQ(board::kindOf(*encoders.at(5)), "quadrature");
}

}  // namespace
}  // namespace probebox::app
