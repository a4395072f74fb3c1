#include <Eigen/Geometry>
#include <cmath>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <random>

#include "firmware/app/result_events.hpp"
#include "measured.hpp"
#include "pulls.hpp"
#include "scenario.hpp"

// The errors of the rotary axis C from balls that it carries, run on the emulated machine.
namespace probebox::scenario {
namespace {

using Eigen::Vector3d;
using procedure::Method;
using world::operator+;

constexpr std::size_t kBalls = 3;

Vector3d vector(const world::Vector3& v) {
  return {v[0], v[1], v[2]};
}

// Where the machine stands when the stylus ball is centred on a ball of the part, probe spindle at A = 0.
Vector3d shown(const world::Config& config, const world::Vector3& at) {
  const auto& spindle = config.probe_spindle;
  return vector(at) - Vector3d{spindle.stylus_offset_mm[0], spindle.stylus_offset_mm[1], 0};
}

// The motion of three balls beside the nominal turn, exactly: translation at the nominal axis point, and rotation.
std::array<double, 6> trueErrors(const world::Config& config, const world::Machine& machine, double phi_rad) {
  const Vector3d point{330, 200, -300};
  const Eigen::AngleAxisd turn{phi_rad, Vector3d::UnitZ()};
  Eigen::Matrix3Xd ideal(3, kBalls), real(3, kBalls);
  for (std::size_t ball = 0; ball < kBalls; ++ball) {
    const auto k = static_cast<Eigen::Index>(ball);
    const auto& spindle = config.part_spindle;
    const auto at_zero = spindle.point_mm + spindle.balls_mm[ball];
    ideal.col(k) = turn * (shown(config, at_zero) - point);
    real.col(k) = shown(config, machine.partPoint(at_zero, {.c_rad = phi_rad})) - point;
  }
  const Eigen::Matrix4d motion = Eigen::umeyama(ideal, real, false);
  const Eigen::AngleAxisd rotation{motion.topLeftCorner<3, 3>()};
  const Vector3d eps = rotation.angle() * rotation.axis();
  return {motion(0, 3), motion(1, 3), motion(2, 3), eps.x(), eps.y(), eps.z()};
}

world::Config turningWorld(std::uint64_t seed) {
  std::mt19937_64 random{seed};
  const auto anywhere = [&](double size) {
    std::uniform_real_distribution<double> uniform{-size, size};
    return world::Vector3{uniform(random), uniform(random), uniform(random)};
  };
  auto config = usualWorld();
  config.part_spindle.errors = {
      .cosine_mm = anywhere(0.01), .sine_mm = anywhere(0.01), .cosine_rad = anywhere(4e-5), .sine_rad = anywhere(4e-5)};
  return config;
}

const ProcedureOptions kFiveAngles{.angles = 5};

TEST(LiveBallPlate, TellsTheErrorsOfTheAxisAtEveryAngle) {
  Pulls translations, rotations;
  for (std::uint64_t seed = 1; seed <= 8; ++seed) {
    const auto config = turningWorld(seed);
    Scenario scenario{config, seed};
    const auto result = measured(scenario, Method::rotary_axis_errors, kFiveAngles);
    ASSERT_TRUE(result);
    EXPECT_EQ(scenario.machine().stylus().contactCount(), 6U * kBalls * 5U);
    const auto& six = *result->find("six_errors");
    ASSERT_EQ(six.values.size(), 30U);
    for (std::size_t stop = 0; stop < 5; ++stop) {
      const auto truth = trueErrors(config, scenario.machine(), 2 * std::numbers::pi / 5 * static_cast<double>(stop));
      for (std::size_t e = 0; e < 6; ++e) {
        EXPECT_LT(six.sd[6 * stop + e], e < 3 ? 2e-3 : 5e-5);
        (e < 3 ? translations : rotations).add(six.values[6 * stop + e], truth[e], six.sd[6 * stop + e]);
      }
    }
    if (seed == 1) expectTheSameFrom(scenario.dataset(), *result);
  }
  translations.expectHonest();
  rotations.expectHonest();
}

TEST(LiveBallPlate, FindsWhereTheAxisIs) {
  Pulls pulls;
  for (std::uint64_t seed = 11; seed <= 16; ++seed) {
    const auto config = usualWorld();
    Scenario scenario{config, seed};
    const auto result = measured(scenario, Method::rotary_axis_errors, kFiveAngles);
    ASSERT_TRUE(result);
    const auto& spindle = config.part_spindle;
    const auto direction = vector(world::unit(spindle.direction));
    const Vector3d point = shown(config, spindle.point_mm) - Vector3d{330, 200, -300};
    add(pulls, *result, "location_mm", {point.x(), point.y()}, 1e-3);
    add(pulls, *result, "tilt_rad", {-direction.y(), direction.x()}, 1e-5);
    EXPECT_EQ(app::subjectOf(scenario.dataset()), "rotary-c");
  }
  pulls.expectHonest();
}

TEST(LiveBallPlate, CountsAnglesFromWhereItReadThePlate) {
  Scenario scenario{usualWorld(), 3};
  ASSERT_TRUE(measured(scenario, Method::rotary_axis_errors, {.angles = 4}));
  const auto& dataset = scenario.dataset();
  EXPECT_EQ(dataset.table("second")->rows(), kBalls);
  EXPECT_EQ(dataset.table("first")->rows(), 4 * kBalls);
  const auto& phi = *dataset.table("first")->column("phi_rad");
  for (std::size_t row = 0; row < phi.size(); ++row)
    EXPECT_NEAR(phi[row], std::numbers::pi / 2 * static_cast<double>(row / kBalls), 1e-9);
}

}  // namespace
}  // namespace probebox::scenario
