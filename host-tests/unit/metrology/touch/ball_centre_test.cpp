#include "firmware/metrology/touch/ball_centre.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "host-tests/metrology/moments.hpp"
#include "host-tests/metrology/touch_simulation.hpp"

namespace probebox::metrology {
namespace {

using simulation::measure;
using simulation::Scene;

// Five touches of one ball at each of three speeds: three readings.
const std::vector<std::size_t> kReadings{0, 0, 0, 0, 0, 1, 1, 1, 1, 1, 2, 2, 2, 2, 2};

Scene scene() {
  Scene scene;
  scene.speeds_mm_s = {8, 15, 25};
  return scene;
}

// What rings on after the contact would stay in the retract.
Scene still(std::mt19937_64& random) {
  Scene ball = simulation::withoutNoise(shuffled(scene(), random));
  ball.bounce_mm = 0;
  return ball;
}

std::array<double, 3> shared(double tau_s) {
  return {tau_s, tau_s, tau_s};
}

TEST(BallCentres, AreExactWithoutNoiseOnceTheDelayIsTakenOut) {
  std::mt19937_64 random{5};
  const Scene ball = still(random);
  const auto centres = ballCentres(measure(ball, random), kReadings, shared(ball.tau()));
  ASSERT_TRUE(centres.ok()) << centres.error().reason;
  ASSERT_EQ(centres->readings.size(), 3U);
  for (const auto& reading : centres->readings) {
    EXPECT_LT((reading.centre_mm - ball.centre_mm).norm(), 1e-6);
    EXPECT_NEAR(reading.radius_mm, ball.radius_mm, 1e-6);
  }
}

TEST(BallCentres, AWrongDelayOfAllAxesGoesIntoTheRadiusBySpeed) {
  std::mt19937_64 random{6};
  const Scene ball = still(random);
  const auto centres = ballCentres(measure(ball, random), kReadings, shared(ball.tau() + 0.001));
  ASSERT_TRUE(centres.ok()) << centres.error().reason;
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_LT((centres->readings[i].centre_mm - ball.centre_mm).norm(), 1e-6);
    EXPECT_NEAR(centres->readings[i].radius_mm, ball.radius_mm + 0.001 * ball.speeds_mm_s[i], 1e-6);
  }
}

TEST(BallCentres, HaveTheUncertaintyThatTheyState) {
  std::mt19937_64 random{7};
  Moments across, along;
  for (int trial = 0; trial < 150; ++trial) {
    const Scene ball = shuffled(scene(), random);
    const auto centres = ballCentres(measure(ball, random), kReadings, shared(ball.tau()));
    ASSERT_TRUE(centres.ok()) << centres.error().reason;
    for (const auto& reading : centres->readings) {
      const Eigen::Vector3d error = reading.centre_mm - ball.centre_mm;
      across.add(error.x(), reading.sd_mm.x());
      across.add(error.y(), reading.sd_mm.y());
      along.add(error.z(), reading.sd_mm.z());
    }
  }
  expectHonest(across);
  expectHonest(along);
  EXPECT_LT(std::abs(across.bias()), 4);
}

// Without a touch along Y nothing tells it: only a machine that has none is content with the circle.
TEST(BallCentres, AreOfACircleOnlyWhereTheMachineHasNoY) {
  std::mt19937_64 random{9};
  Scene ball = still(random);
  const Eigen::Vector3d along_x{1, 0, 0}, along_z{0, 0, 1};
  ball.normals = {along_x, -along_x, along_z, (along_x + along_z).normalized()};
  ball.speeds_mm_s = {15};
  const std::vector<std::size_t> one_reading(ball.normals.size(), 0);
  const auto touches = measure(ball, random);
  const auto of_three_axes = ballCentres(touches, one_reading, shared(ball.tau()));
  ASSERT_FALSE(of_three_axes);
  EXPECT_EQ(of_three_axes.error().name, "coplanar");
  const auto flat = ballCentres(touches, one_reading, shared(ball.tau()), Plane::xz);
  ASSERT_TRUE(flat) << flat.error().reason;
  EXPECT_LT((flat->readings[0].centre_mm - ball.centre_mm).norm(), 1e-6);
  EXPECT_EQ(flat->readings[0].sd_mm.y(), 0);
}

TEST(BallCentres, NameTheReadingThatLacksTouches) {
  std::mt19937_64 random{8};
  const Scene ball = scene();
  auto readings = kReadings;
  for (std::size_t i = 11; i < readings.size(); ++i) readings[i] = 0;
  const auto centres = ballCentres(measure(ball, random), readings, shared(ball.tau()));
  ASSERT_FALSE(centres.ok());
  EXPECT_EQ(centres.error().name, "too-few-readings");
  EXPECT_THAT(centres.error().reason, testing::HasSubstr("reading 3"));
  readings.pop_back();
  EXPECT_EQ(ballCentres(measure(ball, random), readings, shared(0)).error().name, "ragged-table");
}

}  // namespace
}  // namespace probebox::metrology
