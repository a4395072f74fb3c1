#include <cmath>
#include <gtest/gtest.h>

#include "protocol/units/angle.hpp"
#include "streams.hpp"

// A stylus that is led around the datum sphere in contact.
namespace probebox::world {
namespace {

using testing::run;
using testing::seconds;

constexpr double kReach_mm = 15.5;
constexpr double kDeep_mm = 0.4;

// In contact at +X, `deep_mm` behind the surface.
World inContact(const Config& config) {
  World world{config, 1};
  Machine& machine = world.machine();
  double now_s = 0;
  for (const double distance_mm : {18.0, kReach_mm - kDeep_mm}) {
    for (const Vector3& target : {Vector3{config.sphere.centre_mm[0] + distance_mm, config.sphere.centre_mm[1],
                                          distance_mm > 17 ? 110.0 : config.sphere.centre_mm[2]},
                                  config.sphere.centre_mm + Vector3{distance_mm, 0, 0}}) {
      machine.moveTo(target, 100, seconds(now_s));
      now_s += 3;
      run(world, now_s);
    }
  }
  return world;
}

// Angle between the deflection and the normal of the surface at the stylus ball, which has to lie on the sphere.
double frictionAngle(const World& world, const Config& config, double at_s) {
  const Vector3 body = world.machine().bodyAt(seconds(at_s)),
                deflection = world.machine().stylusDisplacementAt(seconds(at_s)),
                ball = body + deflection - config.sphere.centre_mm;
  EXPECT_NEAR(norm(ball), kReach_mm, 1e-9) << "at " << at_s << " s";
  return std::atan2(norm(cross(ball, deflection)), dot(ball, deflection));
}

class AroundTheSphere : public ::testing::TestWithParam<double> {};

TEST_P(AroundTheSphere, TheBallStaysOnItAndTrailsByTheFrictionAngle) {
  Config config = testing::usual();
  config.probe.friction = 0.15;
  World world = inContact(config);
  const double sense = GetParam();
  EXPECT_NEAR(frictionAngle(world, config, 12), 0, 1e-9) << "it came along the normal";
  ASSERT_TRUE(world.machine().slideRound(config.sphere.centre_mm, sense * 3, 20, seconds(12)));
  run(world, 16);
  for (double at_s = 12.001; at_s < 12.1; at_s += 0.001)
    EXPECT_LE(frictionAngle(world, config, at_s), std::atan(0.15) + 1e-9) << "it sticks, and then slides";
  for (double at_s = 12.3; at_s < 16; at_s += 0.05) {
    EXPECT_NEAR(frictionAngle(world, config, at_s), std::atan(0.15), 1e-9);
    const Vector3 body = world.machine().bodyAt(seconds(at_s)) - config.sphere.centre_mm,
                  ball = body + world.machine().stylusDisplacementAt(seconds(at_s));
    EXPECT_LT(sense * cross(body, ball)[2], 0) << "it stays behind";
  }
  EXPECT_EQ(world.machine().stylus().contactCount(), 1U);
}

INSTANTIATE_TEST_SUITE_P(Senses, AroundTheSphere, ::testing::Values(1.0, -1.0));

// A control outside leads the axes cycle by cycle.
TEST_P(AroundTheSphere, ItDoesSoWhereAControlOutsideLeadsIt) {
  Config config = testing::usual();
  config.probe.friction = 0.15;
  World world = inContact(config);
  const double sense = GetParam(), cycle_s = 0.001;
  double angle_rad = 0, now_s = 12;
  const auto follow = [&](double radius_mm) {
    const Vector3 out{radius_mm * std::cos(angle_rad), radius_mm * std::sin(angle_rad), 0};
    world.machine().follow(config.sphere.centre_mm + out, seconds(now_s), seconds(now_s + cycle_s));
    now_s += cycle_s;
  };
  for (int i = 0; i < 2000; ++i) {
    angle_rad += sense * 20 * cycle_s / kReach_mm;
    follow(kReach_mm - kDeep_mm);
  }
  run(world, now_s);
  for (double at_s = 12.3; at_s < 13.9; at_s += 0.05)
    EXPECT_NEAR(frictionAngle(world, config, at_s), std::atan(0.15), 1e-3);
  for (int i = 1; i <= 100; ++i) follow(kReach_mm - kDeep_mm + 0.02 * i);
  run(world, now_s + 1);
  EXPECT_LT(norm(world.machine().stylusDisplacementAt(seconds(now_s + 1))), 1e-6) << "it has come off";
  ASSERT_EQ(world.machine().stylus().contactCount(), 1U);
  EXPECT_TRUE(world.machine().stylus().contact(0)->end);
}

TEST(Slide, EndsWhereTheBodyWithdraws) {
  const Config config = testing::usual();
  World world = inContact(config);
  ASSERT_TRUE(world.machine().slideRound(config.sphere.centre_mm, kTurn / 4, 20, seconds(12)));
  run(world, 15);
  const Vector3 off{0, kReach_mm + 1, 0};
  ASSERT_TRUE(world.machine().moveTo(config.sphere.centre_mm + off, 20, seconds(15)));
  run(world, 17);
  EXPECT_LT(norm(world.machine().stylusDisplacementAt(seconds(17))), 1e-6);
  ASSERT_EQ(world.machine().stylus().contactCount(), 1U);
  const Contact& contact = *world.machine().stylus().contact(0);
  ASSERT_TRUE(contact.end);
  EXPECT_GT(contact.normal[1], 0.99);
  // It sticks on the way out: nothing but that way changes the deflection.
  const Vector3 early = world.machine().stylusDisplacementAt(seconds(15)) + world.machine().bodyAt(seconds(15)),
                later = world.machine().stylusDisplacementAt(seconds(15.005)) + world.machine().bodyAt(seconds(15.005));
  EXPECT_LT(norm(later - early), 1e-9);
}

TEST(Slide, BeyondTheSurfaceTheStylusIsFree) {
  const Config config = testing::usual();
  World world = inContact(config);
  const Vector3 outside = config.sphere.centre_mm + Vector3{std::cos(0.5), std::sin(0.5), 0} + Vector3{15.4, 7.7, 0};
  ASSERT_TRUE(world.machine().slideTo(outside, 20, seconds(12)));
  run(world, 14);
  EXPECT_EQ(norm(world.machine().stylusDisplacementAt(seconds(14))), 0);
}

}  // namespace
}  // namespace probebox::world
