#pragma once
#include <cstdint>

#include "drivers/world/machine.hpp"
#include "drivers/world/vector.hpp"

namespace probebox::world {

// What a control outside commands in one of its cycles: where the motors of X, Y and Z are to stand at its end, as
// their encoders show it, the angles of the rotary axes, and the tool in the spindle.
struct Lead {
  Vector3 motor_mm{};
  Pose pose{};
  std::uint32_t tool{};
  friend bool operator==(const Lead&, const Lead&) = default;
};

}  // namespace probebox::world
