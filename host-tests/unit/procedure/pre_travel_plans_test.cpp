// Whether the stylus fits past the equator of the sphere where the pre-travel of a switch is measured below it.
#include <cmath>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <numbers>

#include "firmware/procedure/methods/methods.hpp"

namespace probebox::procedure {
namespace {

constexpr double kSphere_mm = 25, kBall_mm = 6, kOvertravel_mm = 0.5;

// From the side of the sphere's equator to the middle of the shank, when the ball is pressed in 20 degrees below it.
double roomBesideTheEquator() {
  const double apart_mm = kSphere_mm / 2 + kBall_mm / 2 - kOvertravel_mm;
  return apart_mm * std::cos(20 * std::numbers::pi / 180) - kSphere_mm / 2;
}

ProbeShank shankFrom(double height_mm, double radius_mm) {
  ProbeShank shank;
  shank.from_mm = height_mm;
  shank.radius_mm = radius_mm;
  return shank;
}

std::optional<NotReady> whyNot(std::optional<ProbeShank> shank, double ball_mm = kBall_mm) {
  Facts facts;
  facts.sphere_diameter_mm = kSphere_mm;
  facts.stylus_ball_diameter_mm = ball_mm;
  facts.probe_shank = shank;
  ProcedureOptions options;
  options.overtravel_mm = kOvertravel_mm;
  return kPreTravel.why_unfit(options, facts);
}

TEST(PreTravelPlan, NeedsRoomForTheShankBesideTheEquator) {
  EXPECT_FALSE(whyNot(shankFrom(3, roomBesideTheEquator() - 0.01)));
  const auto refused = whyNot(shankFrom(3, roomBesideTheEquator() + 0.01));
  ASSERT_TRUE(refused);
  EXPECT_THAT(refused->what, testing::HasSubstr("1.59"));
}

// The equator is (12.5 + 3) sin 20 above the middle of the ball.
TEST(PreTravelPlan, TakesAShankThatBeginsAboveTheEquatorForAThinStylus) {
  EXPECT_FALSE(whyNot(shankFrom(5.4, 4)));
  EXPECT_TRUE(whyNot(shankFrom(5.2, 4)));
}

TEST(PreTravelPlan, TakesAStylusForHalfAsWideAsItsBallWhereNobodySays) {
  EXPECT_FALSE(whyNot({}));
  EXPECT_TRUE(whyNot({}, 4)) << "0.66 mm of room for a radius of 1 mm";
}

}  // namespace
}  // namespace probebox::procedure
