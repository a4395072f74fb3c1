#pragma once
#include <Eigen/Core>
#include <span>

#include "firmware/metrology/fit/line.hpp"
#include "firmware/metrology/kinematics/kinematics.hpp"

namespace probebox::metrology {

// How the joints move within the window of a line through the tip's positions: a parabola in time each, or a line.
struct JointPath {
  double t_mean{};               // s
  double half_s{1.0};            // half the window
  Eigen::MatrixXd coefficients;  // a row a joint, of 1, s, s^2 with s = (t - t_mean)/half_s; no rows: no joints

  // Joint positions and rates, every joint at its own time.
  Eigen::VectorXd at(const Eigen::VectorXd& times) const;
  Eigen::VectorXd rates(const Eigen::VectorXd& times) const;
};

// joints: a row a stamp of times, positions their tips. Samples that the line does not use are left out.
JointPath fitJointPath(std::span<const double> times, const Eigen::MatrixXd& joints,
                       const Eigen::Ref<const Rows3>& positions, const Line& line);

// How far the tip moves when every joint is taken by that much later than t (s), mm.
Eigen::Vector3d shiftOf(const Kinematics& machine, const JointPath& path, double t, const Eigen::VectorXd& later);
// What one second more of each joint then adds, mm/s: one column a joint.
Eigen::Matrix3Xd carriedBy(const Kinematics& machine, const JointPath& path, double t, const Eigen::VectorXd& later);

}  // namespace probebox::metrology
