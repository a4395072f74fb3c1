#pragma once
#include <Eigen/Core>
#include <cstddef>

namespace probebox::metrology {

// R2(a): turns vectors of the plane by a, right-handed.
Eigen::Matrix2d turn(double angle_rad);

// How much less certain than the mean of `count` readings the angles make a parameter, squared, from its cofactor with
// unit sigma: 1/(1 - |w|^2) of (B7).
double inflation(double cofactor, std::size_t count);

}  // namespace probebox::metrology
