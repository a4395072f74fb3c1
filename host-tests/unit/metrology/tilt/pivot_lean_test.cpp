// Two tilts of a pivot fit any lean of its axis: how large it is tells a tilt that is wrong.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "host-tests/metrology/cases.hpp"
#include "host-tests/metrology/tilting_table.hpp"

namespace probebox::metrology {
namespace {

using testing::Contains;
using testing::HasSubstr;

Dataset tiltedTable(double off_deg, std::mt19937_64& random) {
  Tilting table;
  table.ball.y() = table.c_axis.y();  // so the readings along the axis contradict no lean
  Dataset dataset = tableDataset(table, {-90, 0}, {0, 180}, 1e-3, random);
  columnNamed(dataset, "readings", "tilt_deg")[0] += off_deg;
  return dataset;
}

TEST(PivotLean, IsRefusedBeyondATenthOfARadian) {
  std::mt19937_64 random{31};
  for (const double off_deg : {30.0, -30.0, 10.0}) {
    for (const bool stated : {true, false}) {
      Dataset dataset = tiltedTable(off_deg, random);
      if (!stated) dataset.config.erase("sigma_mm");
      const auto solved = solve(dataset);
      ASSERT_FALSE(solved) << off_deg;
      EXPECT_EQ(solved.error().name, "implausible");
      EXPECT_THAT(solved.error().reason, HasSubstr("each row"));
    }
  }
}

TEST(PivotLean, IsRefusedInSpaceToo) {
  std::mt19937_64 random{34};
  Dataset dataset = tiltedTable(0, random);
  dataset.method = "table-pivot-3d";
  EXPECT_EQ(refusalOf(dataset), "");
  dataset = tiltedTable(10, random);
  dataset.method = "table-pivot-3d";
  const auto solved = solve(dataset);
  ASSERT_FALSE(solved);
  EXPECT_EQ(solved.error().name, "implausible");
  EXPECT_THAT(solved.error().reason, HasSubstr("lean_yz_rad"));
}

TEST(PivotLean, IsWarnedOfWhereNoMachineLeansSoFar) {
  std::mt19937_64 random{32};
  for (const double off_deg : {1.0, 0.2}) {
    const auto solved = solve(tiltedTable(off_deg, random));
    ASSERT_TRUE(solved) << solved.error().reason;
    EXPECT_THAT(solved->warnings, Contains(HasSubstr("the tilts"))) << off_deg;
  }
}

TEST(PivotLean, IsNotWarnedOfWithinANoisyMachine) {
  std::mt19937_64 random{33};
  for (int trial = 0; trial < 300; ++trial) {
    Tilting table = randomTable(random, 1e-3);
    // Balls that are close to C show the lean poorly.
    table.ball.x() = table.c_axis.x() + uniform(random, 1.0, 40.0);
    const auto solved = solve(tableDataset(table, {-70, 0}, {0, 180}, uniform(random, 1e-3, 1e-2), random));
    ASSERT_TRUE(solved) << solved.error().reason;
    EXPECT_THAT(solved->warnings, Not(Contains(HasSubstr("leans by"))));
  }
}

}  // namespace
}  // namespace probebox::metrology
