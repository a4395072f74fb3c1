#include "firmware/metrology/fit/plane_turn.hpp"

#include <cmath>

namespace probebox::metrology {

Eigen::Matrix2d turn(double angle_rad) {
  const double c = std::cos(angle_rad);
  const double s = std::sin(angle_rad);
  return Eigen::Matrix2d{{c, -s}, {s, c}};
}

double inflation(double cofactor, std::size_t count) {
  return cofactor * static_cast<double>(count);
}

}  // namespace probebox::metrology
