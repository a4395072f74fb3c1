#include <gmock/gmock.h>
#include <gtest/gtest.h>

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
                                  HasSubstr("27 degrees of freedom of the fit")));
  EXPECT_THAT(line(result), HasSubstr("XOC"));
}

TEST(ResultInWords, SaysThatNothingIsLeftWhereEveryReadingIsNeeded) {
  messages::ResultSummary result;
  result.values = {value("centre_mm[0]", 0, 0), value("centre_mm[1]", 0, 0)};
  result.rms = 2e-14;
  EXPECT_THAT(page(result),
              AllOf(HasSubstr("as many unknowns as readings"), Not(HasSubstr("e-14")), HasSubstr("centre X 0 mm")));
  result.dof = 1;
  EXPECT_THAT(page(result), HasSubstr("1 degree of freedom of the fit"));
}

}  // namespace
}  // namespace probebox::command
