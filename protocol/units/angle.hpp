// Angles are radians throughout; degrees are for people, files and registers.
#pragma once

#include <numbers>

namespace probebox {

inline constexpr double kTurn = 2.0 * std::numbers::pi;      // rad
inline constexpr double kDegree = std::numbers::pi / 180.0;  // rad

constexpr double degrees(double angle_rad) {
  return angle_rad * 180.0 / std::numbers::pi;
}
constexpr double radians(double angle_deg) {
  return angle_deg * std::numbers::pi / 180.0;
}

}  // namespace probebox
