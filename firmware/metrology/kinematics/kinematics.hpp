#pragma once
#include <Eigen/Core>
#include <limits>
#include <optional>
#include <string>
#include <vector>

namespace probebox::metrology {

// Forward kinematics of a machine whose axes are not Cartesian (docs/metrology.md A.6c).
class Kinematics {
 public:
  virtual ~Kinematics() = default;

  virtual Eigen::Index size() const = 0;
  // Columns of a table of joint positions: "q1_rad" for a revolute joint, "q2_mm" for a prismatic one.
  virtual std::vector<std::string> columns() const = 0;
  // Position of the tip, mm, for joint positions q, rad or mm; nullopt when no pose has them.
  virtual std::optional<Eigen::Vector3d> reached(const Eigen::VectorXd& q) const = 0;
  // Derivative of the tip by each joint, one column each; NaN when no pose has q.
  virtual Eigen::Matrix3Xd jacobian(const Eigen::VectorXd& q) const = 0;

  // Position of the tip for joint positions close to reachable ones; NaN when no pose has them, so that a fit refuses.
  Eigen::Vector3d tip(const Eigen::VectorXd& q) const {
    return reached(q).value_or(Eigen::Vector3d::Constant(std::numeric_limits<double>::quiet_NaN()));
  }
};

}  // namespace probebox::metrology
