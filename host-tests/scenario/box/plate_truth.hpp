#pragma once
#include <Eigen/Geometry>
#include <array>
#include <cstddef>
#include <cstdint>
#include <random>

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
  const Eigen::Matrix4d motion = Eigen::umeyama(ideal, real, false);
  const Eigen::AngleAxisd rotation{motion.topLeftCorner<3, 3>()};
  const Eigen::Vector3d eps = rotation.angle() * rotation.axis();
  return {motion(0, 3), motion(1, 3), motion(2, 3), eps.x(), eps.y(), eps.z()};
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
