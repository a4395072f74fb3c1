#pragma once
#include <Eigen/Core>
#include <span>

#include "firmware/metrology/fit/line.hpp"
#include "firmware/metrology/kinematics/kinematics.hpp"

namespace probebox::metrology {

// Motion of the joints within the window of a line through the tip positions: a parabola or line in time for each
// joint.
struct JointPath {
  double t_mean{};     // s
  double half_s{1.0};  // half the window
  Eigen::MatrixXd
      coefficients;  // one row per joint: coefficients of 1, s, s^2 with s = (t - t_mean)/half_s; no rows: no joints

  // Joint positions and rates, each joint at its own time.
  Eigen::VectorXd at(const Eigen::VectorXd& times) const;
  Eigen::VectorXd rates(const Eigen::VectorXd& times) const;
};

// joints: one row per stamp of times; positions: their tips. Samples that the line does not use are omitted.
JointPath fitJointPath(std::span<const double> times, const Eigen::MatrixXd& joints,
                       const Eigen::Ref<const Rows3>& positions, const Line& line);

// Displacement of the tip when each joint is evaluated at t plus its own delay (s), mm. Joint delays that differ from
// the mean displace the point off the line.
Eigen::Vector3d shiftOf(const Kinematics& machine, const JointPath& path, double t, const Eigen::VectorXd& later);
// Derivative of the tip position by each joint's delay, mm/s, one column per joint.
Eigen::Matrix3Xd dPointPerDelay(const Kinematics& machine, const JointPath& path, double t,
                                const Eigen::VectorXd& later);

}  // namespace probebox::metrology
