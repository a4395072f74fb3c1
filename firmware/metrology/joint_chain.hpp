#pragma once
#include <Eigen/Core>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "firmware/metrology/dataset.hpp"
#include "firmware/metrology/line.hpp"
#include "firmware/metrology/result.hpp"
#include "protocol/units/outcome.hpp"

// Machines whose axes are not Cartesian: a serial chain of joints (CN101622513, docs/metrology.md A.6c).
namespace probebox::metrology {

// One joint, as it stands with all joints at zero.
struct Joint {
  bool revolute{};            // else prismatic
  Eigen::Vector3d point;      // on the axis, mm; of no matter for a prismatic one
  Eigen::Vector3d direction;  // of the axis, unit; right-handed about it, or along it
};

// From base to tip; the forward kinematics are a product of exponentials.
class JointChain {
 public:
  // tip: mm, with all joints at zero.
  JointChain(std::vector<Joint> joints, const Eigen::Vector3d& tip) : joints_{std::move(joints)}, tip_{tip} {}

  // Table chain{revolute,px_mm,py_mm,pz_mm,ux,uy,uz}, a row a joint, and config tip_mm. Refuses what checkedTable
  // refuses, and: missing-key, bad-config, bad-flag, bad-direction.
  static Outcome<JointChain, Refusal> read(const Dataset& dataset);

  Eigen::Index size() const { return static_cast<Eigen::Index>(joints_.size()); }
  // Of a table of joint positions: "q1_rad" of a revolute joint, "q2_mm" of a prismatic one.
  std::vector<std::string> columns() const;
  // Where the tip is, mm. q: joint positions, rad or mm.
  Eigen::Vector3d tip(const Eigen::VectorXd& q) const;
  // Derivative of the tip by every joint, one column each.
  Eigen::Matrix3Xd jacobian(const Eigen::VectorXd& q) const;

 private:
  std::vector<Joint> joints_;
  Eigen::Vector3d tip_;
};

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
Eigen::Vector3d shiftOf(const JointChain& chain, const JointPath& path, double t, const Eigen::VectorXd& later);
// What one second more of each joint then adds, mm/s: one column a joint.
Eigen::Matrix3Xd carriedBy(const JointChain& chain, const JointPath& path, double t, const Eigen::VectorXd& later);

}  // namespace probebox::metrology
