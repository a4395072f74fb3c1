// Angles are radians throughout; degrees are for people, files and registers.
#pragma once

#include <cmath>
#include <cstddef>
#include <numbers>
#include <span>

namespace probebox {

inline constexpr double kTurn = 2.0 * std::numbers::pi;      // rad
inline constexpr double kDegree = std::numbers::pi / 180.0;  // rad

constexpr double degrees(double angle_rad) {
  return angle_rad * 180.0 / std::numbers::pi;
}
constexpr double radians(double angle_deg) {
  return angle_deg * std::numbers::pi / 180.0;
}

// Whether rising angles within one turn are three or more, equally spaced over it: they determine harmonics.
inline bool areEvenOverTurn(std::span<const double> rising_rad) {
  const double step_rad = kTurn / static_cast<double>(rising_rad.size());
  for (std::size_t k = 1; k < rising_rad.size(); ++k)
    if (std::abs(rising_rad[k] - rising_rad[0] - step_rad * static_cast<double>(k)) > 1e-6) return false;
  return rising_rad.size() >= 3;
}

}  // namespace probebox
