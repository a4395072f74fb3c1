#pragma once
#include "drivers/world/vector.hpp"

namespace probebox::world {

// Where a straight way of the stylus ball's centre meets a surface.
struct Meeting {
  double distance_mm{};  // along the way
  Vector3 normal{};      // of the surface, outward
  bool setter{};         // of the tool-setting device
  double lever{1};       // what the stylus' ball is moved by where what meets the surface is moved by 1
};

}  // namespace probebox::world
