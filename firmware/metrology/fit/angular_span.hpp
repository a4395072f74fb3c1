#pragma once
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

namespace probebox::metrology {

// Smallest arc that holds all the angles, whole turns aside. whole_turn: 2 pi or 360. At least one angle.
inline double angularSpan(std::vector<double> angles, double whole_turn) {
  for (double& angle : angles) angle -= whole_turn * std::floor(angle / whole_turn);
  std::ranges::sort(angles);
  double widest = angles.front() + whole_turn - angles.back();
  for (std::size_t k = 1; k < angles.size(); ++k) widest = std::max(widest, angles[k] - angles[k - 1]);
  return whole_turn - widest;
}

}  // namespace probebox::metrology
