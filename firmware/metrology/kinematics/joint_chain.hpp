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

// Serial chain of joints, for machines without Cartesian axes (CN101622513, docs/metrology.md A.6c).
namespace probebox::metrology {

// Columns of table chain, one row per joint.
inline constexpr MethodColumn kChainColumns[]{column::number("revolute"),
                                              column::given("px_mm"),
                                              column::given("py_mm"),
                                              column::given("pz_mm"),
                                              column::kAlongX,
                                              column::kAlongY,
                                              column::kAlongZ};

// One joint in the zero pose of the chain.
struct Joint {
  bool revolute{};            // else prismatic
  Eigen::Vector3d point;      // on the axis, mm; not used for a prismatic joint
  Eigen::Vector3d direction;  // unit direction of the axis: right-handed rotation about it, or travel along it
};

// Forward kinematics of a serial chain from base to tip, as a product of exponentials.
class JointChain final : public Kinematics {
 public:
  // tip: mm, in the zero pose.
  JointChain(std::vector<Joint> joints, const Eigen::Vector3d& tip) : joints_{std::move(joints)}, tip_{tip} {}

  // Reads table chain and config tip_mm. Refuses what
  // checkedTable refuses, and: missing-key, bad-config, bad-flag, bad-direction.
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
