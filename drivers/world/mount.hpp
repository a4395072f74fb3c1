#pragma once
#include "board/describe/world.hpp"
#include "drivers/world/vector.hpp"

namespace probebox::world {

// Returns where a ball of the part stands in that mount, from the spindle's point at C = 0.
inline Vector3 inMount(const board::WorldMount& mount, const Vector3& ball) {
  return rotation(unit(mount.turn_rad), norm(mount.turn_rad)) * ball + mount.shift_mm;
}

}  // namespace probebox::world
