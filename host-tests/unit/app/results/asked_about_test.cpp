#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "accepting.hpp"

// What does not come into force before a person has said that it should all the same.
namespace probebox::app {
namespace {

using metrology::Estimate;
using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

// What fails its limit would be the reference of the next check, which then passes.
TEST_F(Accepting, ACheckThatFailsIsAskedAboutAndNamedWhileItIsInForce) {
  const auto check = [](double verdict) {
    auto result = resultOf("periodic-check", {Estimate::scalar("Xcen_B0_mm", 330.17, 1e-3)});
    result.also = {Estimate::scalar("verdict", verdict, std::nullopt)};
    if (verdict > 0.5) result.warnings = {"not proven: Xcen_B0_mm is 0.01 mm off the accepted value"};
    if (verdict > 1.5) result.warnings = {"fail: Xcen_B0_mm is 0.05 mm off the accepted value"};
    return result;
  };
  acceptedAs("check", check(0));
  const auto doubtful = results_.accept(propose("check", check(1)), "Ada");
  ASSERT_FALSE(doubtful);
  EXPECT_THAT(doubtful.error().what, AllOf(HasSubstr("NOT PROVEN"), HasSubstr("Xcen_B0_mm"), HasSubstr("0.01 mm")));
  auto moved = check(2);
  moved.estimates[0].values[0] = 331;
  EXPECT_THAT(results_.accept(propose("check", moved), "Ada").error().what,
              AllOf(HasSubstr("check FAILED"), HasSubstr("differs")));
  const auto id = propose("check", check(2));
  const auto refused = results_.accept(id, "Ada");
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().reason, store::Reason::differs);
  EXPECT_THAT(refused.error().what,
              AllOf(HasSubstr("FAILED"), HasSubstr("Xcen_B0_mm"), HasSubstr("0.05 mm"), HasSubstr("next check")));
  EXPECT_THAT(results_.toRepeat(), IsEmpty());
  const auto accepted = results_.accept(id, "Ada", /*although_it_differs=*/true);
  ASSERT_TRUE(accepted) << accepted.error().what;
  EXPECT_THAT(accepted->notes, testing::Contains(HasSubstr("FAILED")));
  EXPECT_THAT(results_.toRepeat(), ElementsAre(HasSubstr("check FAILED")));
  EXPECT_THAT(*store_.history(id),
              testing::Contains(testing::Field(&store::Transition::remark, "although it is not proven to conform")));
}

// A controller reads the verdict of a run before anybody has accepted it, and for as long as it is the newest.
TEST_F(Accepting, ACheckIsServedApartWhileItIsProposed) {
  const auto check = [](double verdict) {
    auto result = resultOf("periodic-check", {Estimate::scalar("Xcen_B0_mm", 330.17, 1e-3)});
    result.also = {Estimate::scalar("verdict", verdict, std::nullopt)};
    return result;
  };
  const auto proposed = [&] {
    results_.showProposed();
    std::vector<std::uint64_t> ids;
    for (const auto& each : results_.served()->proposed) ids.push_back(each.result_id);
    return ids;
  };
  const auto first = acceptedAs("check", check(0)).id;
  EXPECT_THAT(proposed(), IsEmpty());
  const auto failed = propose("check", check(2)), newest = propose("check", check(0));
  propose("centreline", centreAt(0.154, -0.110, "centreline-by-steps"));
  EXPECT_THAT(proposed(), ElementsAre(newest));
  EXPECT_EQ(results_.served()->in_force.front().result_id, first);
  ASSERT_TRUE(results_.accept(newest, "Ada"));
  EXPECT_THAT(proposed(), IsEmpty()) << "result " << failed << " is older than the one in force";
}

TEST_F(Accepting, SaysWhatAResultWarnsOf) {
  auto result = centreAt(0.154, -0.110, "centreline-by-steps");
  result.warnings = {"residuals-exceed-noise: reduced chi-square is 1122"};
  EXPECT_THAT(acceptedAs("centreline", result).notes,
              testing::Contains("Warning: residuals-exceed-noise: reduced chi-square is 1122."));
  result.warnings.assign(20, "something");
  const auto many = acceptedAs("centreline", result);
  EXPECT_THAT(many.notes, testing::Contains(HasSubstr("more warnings: probebox show " + std::to_string(many.id))));
}

// Of the same case, and no verdict on it.
TEST_F(Accepting, TheStylusOffsetOfAFailedCheckIsAnOffset) {
  auto result = offsetOf(0.020, -0.013);
  result.also = {Estimate::scalar("verdict", 2, std::nullopt)};
  EXPECT_TRUE(results_.accept(propose("stylus-offset-1", result), "Ada"));
}

// What one sphere's certificate is off cancels between two runs on it, and not between a run on it and one without.
TEST_F(Accepting, OfAnotherMethodComparesWithTheTypeBPart) {
  const auto delay = [](const char* method, double tau_s) {
    auto result = resultOf(method, {Estimate::scalar("tau_s", tau_s, 1e-6)});
    result.estimates.front().uncertainty = {11e-6};
    return result;
  };
  acceptedAs("delay", delay("delay-known-sphere", 0.0052));
  EXPECT_FALSE(results_.accept(propose("delay", delay("delay-known-sphere", 0.00522)), "Ada"));
  EXPECT_TRUE(results_.accept(propose("delay", delay("delay-multi-speed", 0.00522)), "Ada"));
  EXPECT_FALSE(results_.accept(propose("delay", delay("delay-known-sphere", 0.0053)), "Ada"));
}

// The touches of a delay also tell the probe's gain, which samples then use: by a turned probe it would be another one.
TEST_F(Accepting, ADelayWithAnotherGainOfTheProbeIsAskedAbout) {
  const std::vector<double> upright{0.98, 0.01, -0.005, -0.012, 1.03, 0.004, 0.006, -0.008, 1.01};
  const std::vector<double> turned{-0.012, 1.03, 0.004, -0.98, -0.01, 0.005, 0.006, -0.008, 1.01};
  const auto delay = [](const std::vector<double>& gain, bool angle_stated = true) {
    auto result = resultOf("delay-known-sphere", {Estimate::scalar("tau_s", 0.0052, 1e-6)});
    result.also = {Estimate::matrix("gain_matrix", 3, gain, std::vector<double>(9, 1e-5))};
    if (angle_stated) result.also.push_back(Estimate::scalar("gain_taken_at_A_rad", 0, std::nullopt));
    return result;
  };
  acceptedAs("delay", delay(upright));
  const auto id = propose("delay", delay(turned));
  const auto refused = results_.accept(id, "Ada");
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().reason, store::Reason::differs);
  EXPECT_THAT(refused.error().what, AllOf(HasSubstr("gain_matrix[0]"), HasSubstr("-0.012"), HasSubstr("0.98")));
  EXPECT_TRUE(results_.accept(id, "Ada", /*although_it_differs=*/true));

  const auto unknown = acceptedAs("delay", delay(upright, /*angle_stated=*/false));
  EXPECT_THAT(unknown.notes, testing::Contains(AllOf(HasSubstr("gain_matrix"), HasSubstr("not used"))));
}

}  // namespace
}  // namespace probebox::app
