#pragma once
#include <Eigen/Core>
#include <cstddef>

namespace probebox::metrology {

// R2(a): rotation of the plane by a, right-handed.
Eigen::Matrix2d turn(double angle_rad);

// Variance ratio of a parameter to the mean of `count` readings due to their angles, from its cofactor with unit sigma:
// 1/(1 - |w|^2) of (B7).
double inflation(double cofactor, std::size_t count);

}  // namespace probebox::metrology
