#include "firmware/app/results/result_summary.hpp"

#include <gtest/gtest.h>

namespace probebox::app {
namespace {

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
  EXPECT_EQ(values[0].key, "deviation_XC_at_0_deg_mm");
  EXPECT_EQ(values[7].key, "deviation_YC_at_60_deg_mm");
  EXPECT_EQ(values[7].value, 0.25);
  EXPECT_EQ(values[11].key, "deviation_CC_at_60_deg_rad");
  EXPECT_EQ(values[11].sd, 1e-4);
  EXPECT_EQ(values[13].key, "location_mm[1]");
  EXPECT_FALSE(values[13].has_sd);
  EXPECT_FALSE(values[13].has_u);
  record.binding.subject = "rotary-axis-errors";
  EXPECT_EQ(summaryOf(record).values[7].key, "deviation_Y_at_60_deg_mm") << "of an axis that the case does not name";
}

// Its sd alone is that of the readings: what a person reads behind +/- is the combined one.
TEST(SummaryOfAResult, HasTheCombinedUncertaintyBesideTheSd) {
  metrology::Result result;
  auto six = metrology::Estimate::matrix("six_errors", 6, {1, 2, 3, 4, 5, 6}, {1, 1, 1, 1, 1, 1});
  six.uncertainty = {2, 2, 2, 2, 2, 3};
  auto tau = metrology::Estimate::scalar("tau_s", 5e-3, 3e-6);
  tau.uncertainty = {5e-6};
  result.estimates = {tau, six, metrology::Estimate::scalar("K", -1, 0.01)};
  result.also = {metrology::Estimate::vector("angle_rad", {0}, {})};
  store::Record record{};
  record.binding.subject = "rotary-c";
  record.content = result;
  const auto values = summaryOf(record).values;
  ASSERT_EQ(values.size(), 8U);
  EXPECT_EQ(values[0].sd, 3e-6);
  EXPECT_TRUE(values[0].has_u);
  EXPECT_EQ(values[0].u, 5e-6);
  EXPECT_EQ(values[0].uncertainty(), 5e-6);
  EXPECT_EQ(values[6].key, "deviation_CC_at_0_deg_rad");
  EXPECT_EQ(values[6].uncertainty(), 3.0);
  EXPECT_FALSE(values[7].has_u) << "of a version that had no budget";
  EXPECT_EQ(values[7].uncertainty(), 0.01) << "then sd counts";
}

// The readings of one run determine two quantities: each result shows its own first.
TEST(SummaryOfAResult, BeginsWithTheValuesOfItsSubject) {
  metrology::Result result;
  result.estimates = {metrology::Estimate::vector("offset_C_minus_A_mm", {330, 200}, {1e-4, 1e-4}),
                      metrology::Estimate::vector("stylus_offset_mm", {0.006, 0.017}, {1e-4, 1e-4})};
  result.residuals.unit = "mm";
  store::Record record{};
  record.binding.subject = "stylus-offset-1";
  record.content = result;
  const auto of_stylus = summaryOf(record);
  ASSERT_EQ(of_stylus.values.size(), 4U) << "programs find all of them";
  EXPECT_EQ(of_stylus.about_count, 2U);
  EXPECT_EQ(of_stylus.values[0].key, "stylus_offset_mm[0]");
  EXPECT_EQ(of_stylus.values[2].key, "offset_C_minus_A_mm[0]");
  record.binding.subject = "spindle-offset";
  EXPECT_EQ(summaryOf(record).values[0].key, "offset_C_minus_A_mm[0]");
}

TEST(SummaryOfAResult, HasTheUnitOfItsResiduals) {
  metrology::Result result;
  result.estimates = {metrology::Estimate::scalar("K", -1, 0.01)};
  result.residuals.unit = "um";
  store::Record record{};
  record.binding.subject = "screw-x";
  record.content = result;
  EXPECT_EQ(summaryOf(record).rms_unit, "um");
  result.residuals.unit = "";
  result.design_per = "one reading of the sensor, um";
  record.content = result;
  EXPECT_EQ(summaryOf(record).rms_unit, "um") << "the store has no residuals";
  result.design_per = "";
  record.content = result;
  EXPECT_EQ(summaryOf(record).rms_unit, "mm") << "of a version that did not say: it had no other";
}

TEST(TheCorrectionsAnswer, SaysWhoKnowsTheLengthOfTheToolInTheSpindle) {
  box::State state;
  state.snapshot.swivel.tool = 4;
  state.snapshot.swivel.tool_length_from = published::ValueSource::controller;
  auto answer = correctionsAnswer(state);
  ASSERT_EQ(answer.in_use.size(), 1U);
  EXPECT_EQ(answer.in_use[0].name, "length of tool 4");
  EXPECT_EQ(answer.in_use[0].source, messages::ValueSource::controller);
  state.snapshot.swivel.tool_length_from = published::ValueSource::result;
  state.snapshot.swivel.tool_length_result = 17;
  answer = correctionsAnswer(state);
  EXPECT_EQ(answer.in_use[0].source, messages::ValueSource::result);
  EXPECT_EQ(answer.in_use[0].result_id, 17U);
}

TEST(SummaryOfAResult, ComesInPartsWhereItIsTooLargeForOneAnswer) {
  constexpr std::size_t kMost = 12'000;
  metrology::Result result;
  std::vector<double> errors(6 * 73);
  for (std::size_t i = 0; i < errors.size(); ++i) errors[i] = static_cast<double>(i);
  std::vector<double> angles(73);
  for (std::size_t i = 0; i < angles.size(); ++i) angles[i] = static_cast<double>(i) * 0.0872664625997165;
  result.estimates = {metrology::Estimate::matrix("six_errors", 6, errors, std::vector<double>(errors.size(), 1e-4))};
  result.also = {metrology::Estimate::vector("angle_rad", angles, {})};
  result.warnings.assign(200, std::string(100, 'w'));
  store::Record record{};
  record.binding.subject = "rotary-c";
  record.content = result;
  const auto whole = summaryOf(record);
  ASSERT_GT(messages::encodedSize(whole), kMost);
  std::vector<messages::NamedValue> values;
  int parts = 0;
  for (bool is_all = false; !is_all && parts < 20; ++parts) {
    auto part = whole;
    is_all = keepValues(part, static_cast<std::uint32_t>(values.size()), kMost);
    EXPECT_LE(messages::encodedSize(part), kMost);
    EXPECT_EQ(part.first_value, values.size());
    EXPECT_EQ(part.value_count, whole.values.size());
    EXPECT_NE(part.warnings.back().find("more warnings"), std::string::npos);
    values.insert(values.end(), part.values.begin(), part.values.end());
  }
  EXPECT_GT(parts, 1);
  ASSERT_EQ(values.size(), whole.values.size());
  for (std::size_t i = 0; i < values.size(); ++i) EXPECT_EQ(values[i].key, whole.values[i].key);
}

TEST(SummaryOfAResult, ThatFitsComesWhole) {
  messages::ResultSummary summary;
  summary.values = {{"tau_s", 1e-3, 1e-6, true}};
  EXPECT_TRUE(keepValues(summary, 0, 12'000));
  EXPECT_EQ(summary.values.size(), 1U);
  EXPECT_TRUE(keepValues(summary, 7, 12'000)) << "from beyond the end there is nothing";
  EXPECT_TRUE(summary.values.empty());
}

}  // namespace
}  // namespace probebox::app
