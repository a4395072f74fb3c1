#include "drivers/world/linear_errors.hpp"

#include <cmath>

#include "protocol/units/angle.hpp"

namespace probebox::world {
namespace {

double waveAt(const board::WorldWave& wave, double position_mm) {
  if (wave.amplitude_mm == 0) return 0;
  return wave.amplitude_mm * std::sin(kTurn * position_mm / wave.length_mm + wave.phase_rad);
}

}  // namespace

LinearErrors::LinearErrors(const board::WorldLinearAxes& config)
    : config_{config}, none_{config == board::WorldLinearAxes{}} {}

Vector3 LinearErrors::at(const Vector3& position) const {
  if (none_) return {};
  const auto& [x, y, z] = position;
  const auto& [ea0z_rad, eb0z_rad, ec0y_rad] = config_.squareness_rad;
  // Y is turned about Z, and Z about X and Y, against an X that is straight.
  Vector3 error{eb0z_rad * z - ec0y_rad * y, -ea0z_rad * z, 0};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    error[axis] += config_.scale[axis] * position[axis];
    for (std::size_t direction = 0; direction < 3; ++direction)
      error[direction] += waveAt(config_.waves[axis][direction], position[axis]);
  }
  return error;
}

}  // namespace probebox::world
