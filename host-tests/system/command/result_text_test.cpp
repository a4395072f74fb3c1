#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <vector>

#include "tools/probebox/text/report.hpp"

// What `calibrate` and `results` print about a result.
namespace probebox::command {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

messages::NamedValue value(const std::string& key, double number, double sd) {
  return {.key = key, .value = number, .sd = sd, .has_sd = true, .u = sd, .has_u = true};
}

TEST(ResultInWords, NamesTheLocationOfARotaryAxisAsIso230AndOmitsWhatIsZeroByDefinition) {
  messages::ResultSummary result;
  result.id = 2;
  result.method = "rotary-axis-errors";
  result.subject = "rotary-c";
  result.values = {value("location_mm[0]", 0.129, 3e-4), value("location_mm[1]", 0, 3e-4),
                   value("location_mm[2]", 0, 0), value("tilt_rad[0]", 3e-4, 5e-6), value("tilt_rad[2]", 0, 0)};
  result.dof = 27;
  EXPECT_THAT(page(result), AllOf(HasSubstr("XOC 129.00 +/- 0.30 um"), HasSubstr("YOC 0.00 +/- 0.30 um"),
                                  HasSubstr("AOC 300.0 +/- 5.0 urad"), Not(HasSubstr("ZOC")), Not(HasSubstr("COC")),
                                  HasSubstr("27 degrees")));
  EXPECT_THAT(line(result), HasSubstr("XOC"));
}

TEST(ResultInWords, SaysAtWhichAngleAndLengthAHeadErrs) {
  messages::ResultSummary result;
  result.subject = "swivel-b";
  result.values = {value("error_at_queries_mm[0]", 0.033, 3e-4), value("error_at_queries_mm[4]", 0.012, 3e-4)};
  EXPECT_THAT(page(result), HasSubstr("error Y at query 2 12.00 +/- 0.30 um"));
  metrology::Result kept;
  kept.estimates = {metrology::Estimate::matrix("error_at_queries_mm", 3, std::vector<double>(6, 0.01), {})};
  kept.also = {metrology::Estimate::vector("query_B_deg", {45, 90}, {}),
               metrology::Estimate::vector("query_L_mm", {150, 200}, {})};
  EXPECT_THAT(page(result, &kept), AllOf(HasSubstr("error X at B 45 deg, L 150 mm 33.00 +/- 0.30 um"),
                                         HasSubstr("error Y at B 90 deg, L 200 mm 12.00 +/- 0.30 um")));
}

TEST(ResultInWords, SaysThatNothingIsLeftWhereEveryReadingIsNeeded) {
  messages::ResultSummary result;
  result.values = {value("centre_mm[0]", 0, 0), value("centre_mm[1]", 0, 0)};
  result.rms = 2e-14;
  EXPECT_THAT(page(result), AllOf(HasSubstr("unknowns"), Not(HasSubstr("e-14")), HasSubstr("centre X 0 mm")));
  result.dof = 1;
  EXPECT_THAT(page(result), HasSubstr("1 degree"));
}

}  // namespace
}  // namespace probebox::command
