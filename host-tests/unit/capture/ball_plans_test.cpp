#include <cmath>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <limits>
#include <memory>
#include <numbers>
#include <vector>

#include "firmware/procedure/plan.hpp"
#include "firmware/procedure/run_dataset.hpp"

// The poses in which methods that read one ball are planned.
namespace probebox::procedure {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

// A and C of every reading, in degrees.
std::vector<std::pair<double, double>> posesOf(Method method, const ProcedureOptions& options = {}) {
  const auto plan = std::make_unique<Plan>();
  fill(*plan, method, options);
  std::vector<std::pair<double, double>> poses;
  for (std::size_t k = 0; k < plan->step_count; ++k) {
    const auto& touch = plan->steps[k].touch;
    EXPECT_TRUE(plan->steps[k].turns);
    EXPECT_EQ(plan->steps[k].feature, Feature::part_ball);
    EXPECT_EQ(touch.ball, 1);
    EXPECT_EQ(touch.reading, k / 5);
    if (k % 5 != 0) continue;
    poses.emplace_back(std::round(touch.rotary_angles_rad[0] * 180 / std::numbers::pi),
                       std::round(touch.rotary_angles_rad[2] * 180 / std::numbers::pi));
  }
  return poses;
}

std::string refusal(Method method, const ProcedureOptions& options) {
  const auto why = whyRefused(method, options, std::numeric_limits<double>::infinity());
  return why ? why->what : "";
}

using Pose = std::pair<double, double>;

TEST(BallPlans, TurnBothSpindlesIndependentlyOrTogether) {
  const auto two_by_two = ElementsAre(Pose{0, 0}, Pose{0, 180}, Pose{180, 0}, Pose{180, 180});
  EXPECT_THAT(posesOf(Method::spindle_offset_2x2), two_by_two) << "C turns between any two readings";
  EXPECT_THAT(posesOf(Method::periodic_check), two_by_two);
  EXPECT_THAT(posesOf(Method::spindle_offset_four),
              ElementsAre(Pose{0, 0}, Pose{90, 90}, Pose{180, 180}, Pose{270, 270}));
}

TEST(BallPlans, StayWithinReach) {
  const auto method = Method::centreline_limited_access;
  EXPECT_THAT(posesOf(method), ElementsAre(Pose{0, -40}, Pose{0, 0}, Pose{0, 40}));
  EXPECT_THAT(posesOf(method, {.arc_rad = std::numbers::pi / 3, .angles = 5}),
              ElementsAre(Pose{0, -30}, Pose{0, -15}, Pose{0, 0}, Pose{0, 15}, Pose{0, 30}));
  EXPECT_THAT(refusal(method, {.arc_rad = 0.4}), HasSubstr("30 to 360 degrees"));
  EXPECT_THAT(refusal(method, {.angles = 1}), HasSubstr("2 to 30 angles"));
}

TEST(BallPlans, TakeNoOptionsThatWouldChangeNothing) {
  for (const auto method : {Method::spindle_offset_2x2, Method::spindle_offset_four, Method::periodic_check}) {
    EXPECT_THAT(refusal(method, {.balls = 2}), HasSubstr("takes no number of balls"));
    EXPECT_THAT(refusal(method, {.angles = 4}), HasSubstr("takes no rotary angles"));
  }
}

TEST(BallPlans, NeedADelayAndThePeriodicCheckItsBall) {
  Facts facts;
  EXPECT_THAT(whyUnready(Method::periodic_check, facts, true)->what, HasSubstr("[periodic_check] ball_diameter_mm"));
  facts.checked_ball.emplace();
  EXPECT_THAT(whyUnready(Method::periodic_check, facts, false)->what, HasSubstr("calibrate it first"));
  EXPECT_FALSE(whyUnready(Method::periodic_check, facts, true));
  for (const auto method :
       {Method::spindle_offset_2x2, Method::spindle_offset_four, Method::centreline_limited_access}) {
    EXPECT_THAT(whyUnready(method, facts, false)->what, HasSubstr("calibrate it first"));
    EXPECT_TRUE(findsAPlace(method));
  }
}

TEST(BallPlans, ReadAPlateAtEveryStopAndOnceMoreWhereItBegan) {
  const auto plan = std::make_unique<Plan>();
  fill(*plan, Method::rotary_axis_errors, {.angles = 4, .balls = 3});
  ASSERT_EQ(plan->step_count, 5U * 3U * 5U);
  for (std::size_t k = 0; k < plan->step_count; ++k) {
    const auto& touch = plan->steps[k].touch;
    const std::size_t reading = k / 5, stop = reading / 3;
    EXPECT_EQ(touch.reading, reading);
    EXPECT_EQ(touch.ball, reading % 3 + 1);
    EXPECT_NEAR(touch.rotary_angles_rad[2], stop < 4 ? static_cast<double>(stop) * std::numbers::pi / 2 : 0.0, 1e-12);
  }
  EXPECT_EQ(refusal(Method::rotary_axis_errors, {}), "");
  EXPECT_THAT(refusal(Method::rotary_axis_errors, {.balls = 2}), HasSubstr("3 to 7 balls"));
  EXPECT_THAT(refusal(Method::rotary_axis_errors, {.angles = 12}), HasSubstr("195 touches"));
}

TEST(BallPlans, ReadNoMoreBallsThanThePlateHas) {
  constexpr auto method = Method::rotary_axis_errors;
  Facts facts;
  EXPECT_THAT(whyUnready(method, facts, true)->what, HasSubstr("[ball_plate]"));
  facts.ball_plate = BallPlate{.axis_point_mm = {}, .sd_mm = {}, .balls_mm = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};
  EXPECT_THAT(whyUnready(method, facts, false)->what, HasSubstr("calibrate it first"));
  EXPECT_FALSE(whyUnready(method, facts, true));
  EXPECT_FALSE(whyNoSuchBall(method, {}, facts));
  EXPECT_FALSE(whyNoSuchBall(method, {.balls = 3}, facts));
  EXPECT_THAT(whyNoSuchBall(method, {.balls = 4}, facts)->what, HasSubstr("has 3 balls, and 4 are to be read"));
  EXPECT_FALSE(whyNoSuchBall(Method::c_axis_alignment, {.balls = 4}, facts));
}

}  // namespace
}  // namespace probebox::procedure
