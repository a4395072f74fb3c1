#pragma once
#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

namespace probebox::metrology {

// Forward kinematics of a machine whose axes are not Cartesian (docs/metrology.md A.6c).
class Kinematics {
 public:
  virtual ~Kinematics() = default;

  virtual Eigen::Index size() const = 0;
  // Of a table of joint positions: "q1_rad" of a revolute joint, "q2_mm" of a prismatic one.
  virtual std::vector<std::string> columns() const = 0;
  // Where the tip is, mm. q: joint positions, rad or mm. Nothing where no pose has them.
  virtual std::optional<Eigen::Vector3d> reached(const Eigen::VectorXd& q) const = 0;
  // Derivative of the tip by every joint, one column each. q can be reached.
  virtual Eigen::Matrix3Xd jacobian(const Eigen::VectorXd& q) const = 0;

  // Of joint positions close to some that were reached.
  Eigen::Vector3d tip(const Eigen::VectorXd& q) const { return reached(q).value(); }
};

}  // namespace probebox::metrology
