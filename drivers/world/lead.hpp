#pragma once
#include <cstddef>
#include <cstdint>

#include "drivers/world/machine.hpp"
#include "drivers/world/vector.hpp"

namespace probebox::world {

// Command of an external control for one of its cycles: the encoder positions that X, Y and Z reach at its end, the
// angles of the rotary axes, the tool in the spindle, and the mount that the balls of the part are in.
struct Lead {
  Vector3 motor_mm{};
  Pose pose{};
  std::uint32_t tool{};
  std::size_t mount{1};
  friend bool operator==(const Lead&, const Lead&) = default;
};

}  // namespace probebox::world
