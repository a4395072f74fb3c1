#include "firmware/app/results/result_summary.hpp"

#include <gtest/gtest.h>

namespace probebox::app {
namespace {

TEST(StatusOfTheBox, NamesEverythingThatReachedTheCoreForNothing) {
  box::State state;
  state.latch.late = 1;
  state.latch.disordered = 2;
  state.latch.overwritten = 3;
  state.incomplete_rows = 4;
  state.stray_markers = 5;
  const auto unused = unusedEvents(state);
  EXPECT_EQ(unused.late, 1U);
  EXPECT_EQ(unused.disordered, 2U);
  EXPECT_EQ(unused.overwritten, 3U);
  EXPECT_EQ(unused.incomplete_rows, 4U);
  EXPECT_EQ(unused.stray_markers, 5U);
}

TEST(SummaryOfAResult, NamesTheErrorsOfARotaryAxisByTheirAngle) {
  metrology::Result result;
  std::vector<double> six(12), sd(12, 1e-4);
  six[7] = 0.25;
  six[11] = 3e-5;
  result.estimates = {metrology::Estimate::matrix("six_errors", 6, six, sd),
                      metrology::Estimate::vector("location_mm", {0.1, 0.2, 0}, {})};
  result.also = {metrology::Estimate::vector("angle_rad", {0, 1.0471975511965976}, {})};
  store::Record record{};
  record.binding.subject = "rotary-c";
  record.content = result;
  const auto values = summaryOf(record).values;
  ASSERT_EQ(values.size(), 15U);
  EXPECT_EQ(values[0].key, "EXC_at_0_deg_mm");
  EXPECT_EQ(values[7].key, "EYC_at_60_deg_mm");
  EXPECT_EQ(values[7].value, 0.25);
  EXPECT_EQ(values[11].key, "ECC_at_60_deg_rad");
  EXPECT_EQ(values[11].sd, 1e-4);
  EXPECT_EQ(values[13].key, "location_mm[1]");
  EXPECT_FALSE(values[13].has_sd);
  record.binding.subject = "rotary-axis-errors";
  EXPECT_EQ(summaryOf(record).values[7].key, "EY_at_60_deg_mm") << "of an axis that the case does not name";
}

}  // namespace
}  // namespace probebox::app
