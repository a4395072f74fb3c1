#pragma once
#include <cstdint>

#include "drivers/world/machine.hpp"
#include "drivers/world/vector.hpp"

namespace probebox::world {

// Command of an external control for one of its cycles: the encoder positions that X, Y and Z reach at its end, the
// angles of the rotary axes, and the tool in the spindle.
struct Lead {
  Vector3 motor_mm{};
  Pose pose{};
  std::uint32_t tool{};
  friend bool operator==(const Lead&, const Lead&) = default;
};

}  // namespace probebox::world
