#pragma once
#include <Eigen/Core>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "firmware/metrology/dataset/dataset.hpp"
#include "firmware/metrology/dataset/result.hpp"
#include "firmware/metrology/kinematics/kinematics.hpp"
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
class JointChain final : public Kinematics {
 public:
  // tip: mm, with all joints at zero.
  JointChain(std::vector<Joint> joints, const Eigen::Vector3d& tip) : joints_{std::move(joints)}, tip_{tip} {}

  // Table chain{revolute,px_mm,py_mm,pz_mm,ux,uy,uz}, a row a joint, and config tip_mm. Refuses what checkedTable
  // refuses, and: missing-key, bad-config, bad-flag, bad-direction.
  static Outcome<JointChain, Refusal> read(const Dataset& dataset);

  Eigen::Index size() const override { return static_cast<Eigen::Index>(joints_.size()); }
  std::vector<std::string> columns() const override;
  std::optional<Eigen::Vector3d> reached(const Eigen::VectorXd& q) const override;
  Eigen::Matrix3Xd jacobian(const Eigen::VectorXd& q) const override;

 private:
  std::vector<Joint> joints_;
  Eigen::Vector3d tip_;
};

}  // namespace probebox::metrology
