#include "tools/report/pictures.hpp"

#include <algorithm>
#include <filesystem>
#include <gmock/gmock.h>
#include <string>

#include "firmware/metrology/solve.hpp"
#include "tools/case/case_folder.hpp"
#include "tools/report/sections.hpp"

namespace probebox::report {
namespace {

using testing::HasSubstr;
using testing::Not;

metrology::Dataset caseNamed(const char* name) {
  return casefolder::readCase(std::filesystem::path{PROBEBOX_REPORT_CASES} / name).value();
}

// What is under a title of a page: the lines of the budget.
std::string budgetLine(const metrology::Result& result, const std::string& beginning) {
  const std::string table = budgetTable(result);
  const auto from = table.find(beginning);
  return from == std::string::npos ? "" : table.substr(from, table.find("</tr>", from) - from);
}

// The answer of an axis in another direction.
metrology::Result turned(metrology::Result result, std::vector<double> direction) {
  for (auto& estimate : result.also) {
    if (estimate.key == "axis_direction") estimate.values = direction;
  }
  return result;
}

// The stamps stay as they are, so what is still to be taken out of them does too.
TEST(Pictures, OfStreamsTakeAPreviousDelayOutOnce) {
  for (const auto* name : {"delay-known-sphere", "delay-per-axis"}) {
    auto dataset = caseNamed(name);
    dataset.config.erase("previous_tau_s");
    dataset.config.erase("previous_tau_axis_s");
    const auto alone = streamPictures(dataset, metrology::solve(dataset).value());
    if (dataset.method == "delay-per-axis") dataset.config["previous_tau_axis_s"] = std::vector{0.02, 0.03, 0.01};
    if (dataset.method == "delay-known-sphere") dataset.config["previous_tau_s"] = 0.02;
    const auto on_top = streamPictures(dataset, metrology::solve(dataset).value());
    ASSERT_EQ(alone.size(), 2U) << name;
    ASSERT_EQ(on_top.size(), 2U) << name;
    EXPECT_EQ(alone[1].svg(), on_top[1].svg()) << name;
    EXPECT_NE(alone[0].svg(), alone[1].svg()) << name;
  }
}

TEST(Pictures, OfARotaryAxisShowThePlaneThatItStandsOn) {
  const auto dataset = caseNamed("rotary-axis-errors");
  Subject subject{"case", dataset.method, dataset, metrology::solve(dataset).value()};
  const auto across = [&](double x, double y, double z) {
    subject.dataset->config["axis_direction"] = std::vector{x, y, z};
    subject.answer = turned(std::get<metrology::Result>(subject.answer), {x, y, z});
    return rotaryPictures(subject).front().svg();
  };
  EXPECT_THAT(across(0, 0, 1), testing::AllOf(HasSubstr("around the axis"), HasSubstr("deviation XC (\u00b5m)"),
                                              HasSubstr("deviation YC (\u00b5m)")));
  EXPECT_THAT(across(0, 1, 0), testing::AllOf(HasSubstr("ZB (\u00b5m)"), HasSubstr("XB (\u00b5m)"),
                                              Not(HasSubstr("deviation YB (\u00b5m)"))));
  EXPECT_THAT(across(0.999, 0.04, 0), testing::AllOf(HasSubstr("YA (\u00b5m)"), HasSubstr("ZA (\u00b5m)")));
  EXPECT_NE(across(0, 1, 0), across(0, -1, 0)) << "it turns the other way";
  subject.dataset.reset();
  for (const auto& plot : rotaryPictures(subject)) EXPECT_THAT(plot.svg(), Not(HasSubstr("around the axis")));
}

TEST(Budget, HasNoRowThatAddsNothingAndShowsNextToNothingAsNothing) {
  metrology::Result result;
  result.estimates = {metrology::Estimate::scalar("tau_s", 5e-3, 1e-6)};
  result.budget = {
      {"readings", false, {1e-6}}, {"sd_scale", true, {0}}, {"sd_ball", true, {3e-20}}, {"stop", true, {0}}};
  EXPECT_EQ(budgetLine(result, "<td>stop"), "") << "nobody states it, and it adds nothing";
  EXPECT_THAT(budgetLine(result, "<td>sd_scale"), HasSubstr(">0</td>"));
  EXPECT_THAT(budgetLine(result, "<td>sd_ball"), HasSubstr(">0</td>"));
  EXPECT_THAT(budgetLine(result, "<td>readings"), HasSubstr(">1.0</td>"));
}

// 3, 4 and 12 us: parts 9, 16 and 144 of 169.
TEST(Budget, HasTheLargestCauseFirstInItsChart) {
  metrology::Result result;
  result.estimates = {metrology::Estimate::scalar("tau_s", 5e-3, 3e-6)};
  result.estimates[0].uncertainty = {13e-6};
  result.budget = {{"readings", false, {3e-6}}, {"sd_scale", true, {4e-6}}, {"sd_ball", true, {12e-6}}};
  const auto table = budgetTable(result);
  const auto chart = table.substr(table.find("class=\"shares\""));
  EXPECT_THAT(chart, testing::AllOf(HasSubstr("width:85.2%"), HasSubstr("width:9.47%"), HasSubstr("width:5.33%")));
  EXPECT_LT(chart.find("width:85.2%"), chart.find("width:9.47%"));
  EXPECT_LT(chart.find("width:9.47%"), chart.find("width:5.33%"));
}

TEST(Budget, OfSixErrorsHasLengthsAndAnglesApart) {
  metrology::Result result;
  result.estimates.push_back(metrology::Estimate::matrix(
      "six_errors", 6, std::vector<double>(12), {1e-3, 2e-3, 3e-3, 4e-6, 5e-6, 6e-6, 4e-3, 1e-3, 1e-3, 7e-6, 1e-6, 0}));
  result.budget = {{"readings", false, result.estimates[0].sd}};
  EXPECT_THAT(budgetTable(result),
              testing::AllOf(HasSubstr(">translations (\u00b5m)<"), HasSubstr(">rotations (\u00b5rad)<")));
  EXPECT_THAT(budgetLine(result, "<td>readings"), testing::AllOf(HasSubstr(">4.0<"), HasSubstr(">7.0<")));
  EXPECT_THAT(budgetLine(result, "<td>U (k = 2)"), testing::AllOf(HasSubstr(">8.0<"), HasSubstr(">14<")));
}

}  // namespace
}  // namespace probebox::report
