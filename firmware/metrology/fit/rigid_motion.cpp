#include "firmware/metrology/fit/rigid_motion.hpp"

#include <Eigen/Geometry>
#include <cmath>
#include <string>

#include "firmware/metrology/fit/decompositions.hpp"

namespace probebox::metrology {
namespace {

constexpr double kLine = 1e-6;

}  // namespace

Outcome<RigidMotion, Refusal> registerRigid(const Eigen::MatrixX3d& from, const Eigen::MatrixX3d& to) {
  if (from.rows() < 3) {
    return Refusal{"too-few-balls",
                   std::to_string(from.rows()) + " balls do not determine six errors: measure three or more"};
  }
  const Eigen::RowVector3d from_mean = from.colwise().mean();
  const Eigen::RowVector3d to_mean = to.colwise().mean();
  const Eigen::MatrixXd centred = from.rowwise() - from_mean;
  const Eigen::VectorXd widths = singularValues(centred);
  if (!(widths[1] > kLine * widths[0])) {
    return Refusal{"collinear",
                   "the balls lie on one line and do not determine the rotation about it: add a ball beside the line"};
  }
  const Eigen::Matrix3d moment = (to.rowwise() - to_mean).transpose() * centred;
  const SingularSystem axes = singularSystem(moment);
  const Eigen::Matrix3d left = axes.left, right = axes.right;
  const double handed = determinant(left * right.transpose());
  RigidMotion motion;
  motion.rotation = left * Eigen::Vector3d{1.0, 1.0, handed}.asDiagonal() * right.transpose();
  motion.shift = to_mean.transpose() - motion.rotation * from_mean.transpose();
  return motion;
}

Eigen::Vector3d rotationVector(const Eigen::Matrix3d& rotation) {
  const Eigen::AngleAxisd turned{rotation};
  return turned.angle() * turned.axis();
}

Eigen::Matrix<double, 3, 6> smallMotionRows(const Eigen::Vector3d& lever) {
  Eigen::Matrix<double, 3, 6> rows;
  // rotation x lever, as a matrix on the rotation
  rows << Eigen::Matrix3d::Identity(),
      Eigen::Matrix3d{{0.0, lever.z(), -lever.y()}, {-lever.z(), 0.0, lever.x()}, {lever.y(), -lever.x(), 0.0}};
  return rows;
}

Eigen::Matrix2d turn(double angle_rad) {
  const double c = std::cos(angle_rad);
  const double s = std::sin(angle_rad);
  return Eigen::Matrix2d{{c, -s}, {s, c}};
}

double inflation(double cofactor, std::size_t count) {
  return cofactor * static_cast<double>(count);
}

}  // namespace probebox::metrology
