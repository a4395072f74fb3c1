#pragma once
#include <Eigen/Core>
#include <span>
#include <vector>

#include "firmware/metrology/centreline/centreline.hpp"
#include "firmware/metrology/fit/line.hpp"
#include "firmware/metrology/kinematics/joint_path.hpp"

// The problems of the iterative methods as Ceres is told them: its own derivatives (automatic), its own minimiser
// (Levenberg-Marquardt, dense QR), run until rounding stops it. Nothing of the product but the data. covariance: of the
// answer where it is asked for, as the residuals are weighted.
namespace probebox::judge {

// centre, radius. (B2)
Eigen::Vector4d sphere(const metrology::Rows3& points, Eigen::MatrixXd* covariance = nullptr);

// centre, arm at zero; every reading's own angle is a parameter that its noise holds. (B8)
Eigen::Vector4d rotation(std::span<const metrology::RotationReading> readings, const metrology::RotationNoise& noise,
                         Eigen::MatrixXd* covariance = nullptr);

// Shift and rotation vector that bring `from` to `to`. (E5), (E3)
using Motion = Eigen::Matrix<double, 6, 1>;
Motion rigid(const Eigen::MatrixX3d& from, const Eigen::MatrixX3d& to, Eigen::MatrixXd* covariance = nullptr);

// One touch of (A12) after its own extrapolation: the point, the velocity, and what its radial residual is uncertain
// by.
struct TouchedPoint {
  Eigen::Vector3d at;
  Eigen::Vector3d velocity;
  double sigma{};
};
// centre, radius, delay. start: the same.
using TouchAnswer = Eigen::Matrix<double, 5, 1>;
TouchAnswer touches(std::span<const TouchedPoint> points, const TouchAnswer& start,
                    Eigen::MatrixXd* covariance = nullptr);

// The same of an arm with two links in the plane and a quill along Z, each joint with a delay of its own. (A21)
struct Arm {
  Eigen::Vector3d base{-330.0, -140.0, 60.0};
  double upper{300.0};
  double fore{250.0};
};
struct ArmTouch {
  TouchedPoint touch;
  double at_s{};  // when the joints stood at the point
  metrology::JointPath joints;
};
// centre, radius, delays of the three joints.
using ArmAnswer = Eigen::Matrix<double, 7, 1>;
ArmAnswer armTouches(const Arm& arm, std::span<const ArmTouch> points, const ArmAnswer& start);

// A point that tilts about an axis that is nearly parallel to Z: pivot of the axis in x, y at z = 0, its lean in x and
// y, then x, y, z of every point at tilt zero. (B29) in space.
struct TiltedPoint {
  Eigen::Vector3d at;
  double tilt{};  // rad
  std::size_t point{};
};
Eigen::VectorXd pivot(std::span<const TiltedPoint> readings, const Eigen::VectorXd& start);

}  // namespace probebox::judge
