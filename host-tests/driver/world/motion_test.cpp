#include "drivers/world/motion.hpp"

#include <cmath>
#include <gtest/gtest.h>

#include "drivers/world/random.hpp"
#include "streams.hpp"

namespace probebox::world {
namespace {

using testing::seconds;

struct Case {
  double length_mm;
  MotionLimits limits;
};

Case randomCase(Random& random) {
  return {std::pow(10, random.uniform(-3, 2.5)),
          {std::pow(10, random.uniform(0, 2.7)), std::pow(10, random.uniform(2.5, 4.3)), random.uniform(0.0002, 0.01)}};
}

TEST(Profile, ObeysSpeedAccelerationAndJerk) {
  Random random{1, 1};
  for (int i = 0; i < 300; ++i) {
    const auto [length, limits] = randomCase(random);
    const Profile profile{length, limits};
    const double h = profile.duration() / 2000;
    double last_speed = 0, last_acceleration = 0;
    for (int k = 1; k <= 2001; ++k) {
      const double t = k * h;
      const double speed = profile.speedAt(t);
      const double acceleration = (speed - last_speed) / h;
      ASSERT_LE(speed, limits.speed_mm_s * (1 + 1e-9));
      ASSERT_GE(speed, -1e-9);
      ASSERT_LE(std::abs(acceleration), limits.acceleration_mm_s2 * (1 + 1e-6) + 1e-6);
      ASSERT_LE(std::abs(acceleration - last_acceleration) / h,
                2 * limits.acceleration_mm_s2 / limits.jerk_time_s * (1 + 1e-6) + 1);
      last_speed = speed;
      last_acceleration = acceleration;
    }
  }
}

TEST(Profile, GoesExactlyTheLengthAndNeverBack) {
  Random random{2, 1};
  for (int i = 0; i < 300; ++i) {
    const auto [length, limits] = randomCase(random);
    const Profile profile{length, limits};
    EXPECT_EQ(profile.distanceAt(0), 0);
    EXPECT_EQ(profile.distanceAt(profile.duration()), length);
    EXPECT_NEAR(profile.distanceAt(profile.duration() * (1 - 1e-12)), length, 1e-8);
    double last = 0;
    for (int k = 1; k <= 1000; ++k) {
      const double distance = profile.distanceAt(profile.duration() * k / 1000);
      ASSERT_GE(distance, last - 1e-9);
      last = distance;
    }
  }
}

TEST(Profile, SpeedIsTheDerivativeOfDistance) {
  Random random{3, 1};
  for (int i = 0; i < 200; ++i) {
    const auto [length, limits] = randomCase(random);
    const Profile profile{length, limits};
    const double h = 1e-5 * profile.duration();
    for (int k = 1; k < 100; ++k) {
      const double t = profile.duration() * k / 100;
      const double slope = (profile.distanceAt(t + h) - profile.distanceAt(t - h)) / (2 * h);
      ASSERT_NEAR(slope, profile.speedAt(t), 2e-4 * limits.speed_mm_s);
    }
  }
}

TEST(Profile, CruisesAtTheCommandedSpeedWhenThereIsRoom) {
  const Profile profile{1.1, {40, 10'000, 0.001}};
  EXPECT_NEAR(profile.speedAt(profile.duration() / 2), 40, 1e-12);
  EXPECT_NEAR(profile.timeAt(0.55), profile.duration() / 2, 1e-12);
}

TEST(MotionHistory, RemembersWhereTheBodyWas) {
  MotionHistory motion{{1, 2, 3}};
  EXPECT_TRUE(motion.atRest(seconds(5)));
  motion.append({4, 6, 3}, {10, 1000, 0.001}, seconds(1));
  EXPECT_FALSE(motion.atRest(seconds(1.2)));
  motion.append({4, 6, 8}, {10, 1000, 0.001}, seconds(2));
  EXPECT_EQ(motion.positionAt(seconds(0.5)), (Vector3{1, 2, 3}));
  EXPECT_EQ(motion.positionAt(seconds(1.9)), (Vector3{4, 6, 3}));
  EXPECT_EQ(motion.positionAt(seconds(3), 1.0), (Vector3{4, 6, 3})) << "a delay looks back";
  EXPECT_EQ(motion.positionAt(seconds(3)), (Vector3{4, 6, 8}));
  EXPECT_EQ(motion.target(), (Vector3{4, 6, 8}));
}

TEST(Machine, RefusesAMoveWhileOneIsUnderWay) {
  Machine machine{testing::usual()};
  EXPECT_TRUE(machine.moveTo({0, 0, 100}, 50, seconds(1)));
  EXPECT_FALSE(machine.moveTo({0, 0, 90}, 50, seconds(1.01)));
  EXPECT_EQ(machine.commandedPosition(), (Vector3{0, 0, 100}));
  EXPECT_TRUE(machine.moveTo({0, 0, 90}, 50, seconds(9)));
}

}  // namespace
}  // namespace probebox::world
