#pragma once
#include <Eigen/Core>
#include <cstddef>

#include "firmware/metrology/dataset/result.hpp"
#include "protocol/units/outcome.hpp"

namespace probebox::metrology {

// A rigid motion: point -> rotation * point + shift.
struct RigidMotion {
  Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();
  Eigen::Vector3d shift = Eigen::Vector3d::Zero();

  Eigen::Vector3d operator()(const Eigen::Vector3d& point) const { return rotation * point + shift; }
};

// Finds the least-squares motion of `from` to `to`, row by row, mm (Kabsch, without reflections; docs/metrology.md
// (E3)). Refuses: too-few-balls (3), collinear (second width below 1e-9 of the first).
Outcome<RigidMotion, Refusal> registerRigid(const Eigen::MatrixX3d& from, const Eigen::MatrixX3d& to);

// Rotation vector of a rotation below half a turn, rad.
Eigen::Vector3d rotationVector(const Eigen::Matrix3d& rotation);

// Rows of (E5) for a point at `lever` from the reference: displacement = rows * (translation, rotation).
Eigen::Matrix<double, 3, 6> smallMotionRows(const Eigen::Vector3d& lever);

// R2(a): rotation of the plane by a, right-handed.
Eigen::Matrix2d turn(double angle_rad);

// Variance ratio of a parameter to the mean of `count` readings due to their angles, from its cofactor with unit sigma:
// 1/(1 - |w|^2) of (B7).
double inflation(double cofactor, std::size_t count);

}  // namespace probebox::metrology
