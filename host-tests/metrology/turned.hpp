#pragma once
#include <Eigen/Geometry>

namespace probebox::metrology {

// The rotation about a vector by its length.
inline Eigen::Matrix3d turned(const Eigen::Vector3d& rotation) {
  const double angle = rotation.norm();
  return angle == 0.0 ? Eigen::Matrix3d::Identity() : Eigen::AngleAxisd{angle, rotation / angle}.toRotationMatrix();
}

}  // namespace probebox::metrology
