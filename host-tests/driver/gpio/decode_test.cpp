#include "drivers/gpio/decode.hpp"

#include <gmock/gmock.h>
#include <rapidcheck/gtest.h>

#include "drivers/gpio/lines.hpp"

namespace probebox::gpio {
namespace {

using board::ActiveLevel;

const std::vector<WatchedLine> kLines{{4, LineRole::sync, 0, ActiveLevel::high, Edges::active},
                                      {9, LineRole::skip, 1, ActiveLevel::low, Edges::both}};

TEST(EdgeDecoder, GivesRolePolarityAndTimeOfAnEdge) {
  EdgeDecoder decoder{kLines};
  const auto sync = decoder.decode({4, true, 123456789, 7});
  ASSERT_TRUE(sync);
  EXPECT_EQ(sync->role, LineRole::sync);
  EXPECT_EQ(sync->level, Level::active);
  EXPECT_EQ(sync->line_sequence, 7U);
  EXPECT_EQ(toNs(sync->at), 123456789);

  const auto skip = decoder.decode({9, false, 5, 1});
  ASSERT_TRUE(skip);
  EXPECT_EQ(skip->role, LineRole::skip);
  EXPECT_EQ(skip->line, 1);
  EXPECT_EQ(skip->level, Level::active) << "an active low line falls into its active level";
  EXPECT_EQ(decoder.decode({9, true, 6, 2})->level, Level::inactive);
}

TEST(EdgeDecoder, CountsEdgesOfLinesThatNobodyWatches) {
  EdgeDecoder decoder{kLines};
  EXPECT_FALSE(decoder.decode({5, true, 1, 1}));
  EXPECT_EQ(decoder.unknownEdges(), 1U);
}

RC_GTEST_PROP(EdgeDecoder, KeepsTheGapsOfALineAndAddsNoneAtARestart, (std::vector<std::uint8_t> steps)) {
  EdgeDecoder decoder{kLines};
  std::uint32_t kernel = 0;
  std::uint32_t truth = 0;
  for (const auto step : steps) {
    if (step == 0) {
      decoder.restart(kLines);
      kernel = 0;
      continue;
    }
    kernel += step;
    truth += step;
    RC_ASSERT(decoder.decode({4, true, 0, kernel})->line_sequence == truth);
  }
}

TEST(Lines, AreAskedForOneByOneWithTheEdgesThatTheirRoleNeeds) {
  board::Box box;
  box.sync = {"sync", "gpiochip0", 4U, ActiveLevel::low};
  box.triggers = {{"a", "gpiochip1", 0U, ActiveLevel::high},
                  {"b", "gpiochip0", std::string{"TOUCH"}, ActiveLevel::high}};
  box.indexes = {{{"index Z", "gpiochip0", 8U, ActiveLevel::high}, 2}};
  const auto lines = linesApart(box);
  ASSERT_EQ(lines.size(), 4U);
  for (const auto& line : lines) ASSERT_EQ(line.lines.size(), 1U);
  EXPECT_EQ(lines[0].lines[0].watched.edges, Edges::active);
  EXPECT_EQ(lines[0].lines[0].watched.active, ActiveLevel::low);
  EXPECT_EQ(lines[1].chip, "gpiochip1");
  EXPECT_EQ(lines[1].lines[0].watched.line, 0);
  EXPECT_EQ(std::get<std::string>(lines[2].lines[0].address), "TOUCH");
  EXPECT_EQ(lines[2].lines[0].watched.line, 1);
  EXPECT_EQ(lines[2].lines[0].watched.edges, Edges::both);
  EXPECT_EQ(lines[3].lines[0].watched.line, 2) << "an index line carries the number of its axis";
}

}  // namespace
}  // namespace probebox::gpio
