#pragma once
#include <Eigen/Geometry>
#include <array>
#include <cstddef>
#include <cstdint>
#include <random>

#include "firmware/metrology/fit/decompositions.hpp"
#include "host-tests/emulation/scenario.hpp"

// The balls that C of the emulated machine carries, and what C really does.
namespace probebox::scenario {

inline constexpr std::size_t kBalls = 3;

inline Eigen::Vector3d vector(const world::Vector3& v) {
  return {v[0], v[1], v[2]};
}

// Where the machine stands when the stylus ball is centred on a ball of the part, probe spindle at A = 0.
inline Eigen::Vector3d shown(const world::Config& config, const world::Vector3& at) {
  const auto& spindle = config.probe_spindle;
  return vector(at) - Eigen::Vector3d{spindle.stylus_offset_mm[0], spindle.stylus_offset_mm[1], 0};
}

// The rigid motion that leads `from` nearest to `to`, column by column (Kabsch).
inline Eigen::Isometry3d motionBetween(const Eigen::Matrix3Xd& from, const Eigen::Matrix3Xd& to) {
  const Eigen::Vector3d middle = from.rowwise().mean(), moved = to.rowwise().mean();
  const auto svd = metrology::singularSystem((to.colwise() - moved) * (from.colwise() - middle).transpose());
  Eigen::Matrix3d left = svd.left;
  const Eigen::Matrix3d right = svd.right;
  const auto handedness = [](const Eigen::Matrix3d& m) { return m.col(0).cross(m.col(1)).dot(m.col(2)); };
  if (handedness(left) * handedness(right) < 0) left.col(2) = -left.col(2);  // no reflection
  Eigen::Isometry3d motion = Eigen::Isometry3d::Identity();
  motion.linear() = left * right.transpose();
  motion.translation() = moved - motion.linear() * middle;
  return motion;
}

// Translation in mm and rotation vector in rad of a motion.
inline std::array<double, 6> sixErrorsOf(const Eigen::Isometry3d& motion) {
  const Eigen::AngleAxisd rotation{motion.linear()};
  const Eigen::Vector3d eps = rotation.angle() * rotation.axis(), shift = motion.translation();
  return {shift.x(), shift.y(), shift.z(), eps.x(), eps.y(), eps.z()};
}

// The motion of three balls beside the nominal turn, exactly: translation at the nominal axis point, and rotation.
inline std::array<double, 6> trueErrors(const world::Config& config, const world::Machine& machine, double phi_rad) {
  const Eigen::Vector3d point{330, 200, -300};
  const Eigen::AngleAxisd turn{phi_rad, Eigen::Vector3d::UnitZ()};
  Eigen::Matrix3Xd ideal(3, kBalls), real(3, kBalls);
  for (std::size_t ball = 0; ball < kBalls; ++ball) {
    const auto k = static_cast<Eigen::Index>(ball);
    const auto& spindle = config.part_spindle;
    const auto at_zero = world::operator+(spindle.point_mm, spindle.balls_mm[ball]);
    ideal.col(k) = turn * (shown(config, at_zero) - point);
    real.col(k) = shown(config, machine.partPoint(at_zero, {.c_rad = phi_rad})) - point;
  }
  return sixErrorsOf(motionBetween(ideal, real));
}

inline world::Config turningWorld(std::uint64_t seed) {
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

}  // namespace probebox::scenario
