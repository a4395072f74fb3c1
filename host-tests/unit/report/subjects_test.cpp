#include "tools/report/subjects.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tools/case/solve_json.hpp"

namespace probebox::report {
namespace {

using testing::HasSubstr;

TEST(Subjects, OfAnAnswerHaveTheSdOfWhatWasFoundOnTheWay) {
  metrology::Result result;
  result.method = "swivel-error";
  result.estimates = {metrology::Estimate::scalar("tau_s", 1.0, 0.1)};
  result.also = {metrology::Estimate::matrix("swivel_terms_mm", 2, {1.0, 2.0, 3.0, 4.0}, {0.1, 0.2, 0.3, 0.4})};
  const auto read = subjectsOf(casefolder::toJson(result, "case").dump(), "answers");
  ASSERT_TRUE(read.ok());
  EXPECT_EQ(read->front().result()->find("swivel_terms_mm")->sd, result.also.front().sd);
}

TEST(Subjects, SayWhatCannotBeRead) {
  EXPECT_THAT(subjectsOf("", "x").error().what, HasSubstr("x: empty"));
  EXPECT_THAT(subjectsOf("{\"a\":1}", "x").error().what, HasSubstr("no answer"));
  EXPECT_THAT(subjectsOf("{\"status\":", "x").error().what, testing::AllOf(HasSubstr("line 1"), HasSubstr("JSON")));
  EXPECT_THAT(subjectsIn("/no/such/thing").error().what, HasSubstr("/no/such/thing"));
  EXPECT_THAT(subjectsIn("/proc/self/mem").error().what, HasSubstr("no such")) << "which fails to be read";
}

}  // namespace
}  // namespace probebox::report
