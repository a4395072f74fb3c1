#pragma once
#include "drivers/world/vector.hpp"

namespace probebox::world {

// Point at which a straight path of the stylus ball's centre meets a surface.
struct Meeting {
  double distance_mm{};  // along the way
  Vector3 normal{};      // of the surface, outward
  bool setter{};         // of the tool-setting device
  double lever{1};       // displacement of the stylus' ball per displacement of the touching part
};

}  // namespace probebox::world
