#pragma once
#include "drivers/world/vector.hpp"

namespace probebox::world {

// Describes another mount of the ball plate on the part's spindle: turned about the spindle's point, then shifted.
struct MountConfig {
  Vector3 turn_rad{};  // rotation vector
  Vector3 shift_mm{};

  Vector3 place(const Vector3& ball) const { return rotation(unit(turn_rad), norm(turn_rad)) * ball + shift_mm; }
};

}  // namespace probebox::world
