#include "firmware/metrology/kinematics/joint_chain.hpp"

#include <Eigen/Geometry>
#include <array>
#include <cmath>
#include <string_view>

#include "firmware/metrology/dataset/configuration.hpp"
#include "firmware/metrology/dataset/table_columns.hpp"

namespace probebox::metrology {
namespace {

using Eigen::Index;
using Eigen::Vector3d;
using Eigen::VectorXd;

Vector3d turned(const Joint& joint, double angle, const Vector3d& at) {
  return joint.point + Eigen::AngleAxisd{angle, joint.direction} * (at - joint.point);
}

}  // namespace

Outcome<JointChain, Refusal> JointChain::read(const Dataset& dataset) {
  TRY(const auto table, checkedTable(dataset, "chain", kChainColumns));
  TRY(const auto tip, requiredVector(dataset, "tip_mm"));
  const Eigen::MatrixXd rows = columnsOf(*table, kChainColumns);
  std::vector<Joint> joints;
  for (Index row = 0; row < rows.rows(); ++row) {
    const std::string name = "table 'chain', row " + std::to_string(row + 1) + ": ";
    if (rows(row, 0) != 0.0 && rows(row, 0) != 1.0) {
      return Refusal{"bad-flag", name + "revolute must be 1, or 0 for a prismatic joint"};
    }
    const Vector3d direction = rows.row(row).tail<3>().transpose();
    if (std::abs(direction.norm() - 1.0) > 1e-3) {
      return Refusal{"bad-direction", name + "the direction (ux,uy,uz) of the axis must have length 1"};
    }
    joints.push_back({rows(row, 0) == 1.0, rows.row(row).segment<3>(1).transpose(), direction.normalized()});
  }
  return JointChain{std::move(joints), Vector3d{tip.data()}};
}

std::vector<std::string> JointChain::columns() const {
  std::vector<std::string> names;
  for (const auto& joint : joints_) {
    names.push_back("q" + std::to_string(names.size() + 1) + (joint.revolute ? "_rad" : "_mm"));
  }
  return names;
}

std::optional<Vector3d> JointChain::reached(const VectorXd& q) const {
  Vector3d at = tip_;
  for (Index k = size() - 1; k >= 0; --k) {
    const Joint& joint = joints_[static_cast<std::size_t>(k)];
    at = joint.revolute ? turned(joint, q[k], at) : Vector3d{at + q[k] * joint.direction};
  }
  return at;
}

Eigen::Matrix3Xd JointChain::jacobian(const VectorXd& q) const {
  const Vector3d tip = this->tip(q);
  Eigen::Matrix3Xd columns{3, size()};
  Eigen::Isometry3d moved = Eigen::Isometry3d::Identity();  // by the joints before this one
  for (Index k = 0; k < size(); ++k) {
    const Joint& joint = joints_[static_cast<std::size_t>(k)];
    const Vector3d direction = moved.linear() * joint.direction;
    if (joint.revolute) {
      columns.col(k) = direction.cross(tip - moved * joint.point);
      moved = moved * Eigen::Translation3d{joint.point} * Eigen::AngleAxisd{q[k], joint.direction} *
              Eigen::Translation3d{-joint.point};
    } else {
      columns.col(k) = direction;
      moved = moved * Eigen::Translation3d{q[k] * joint.direction};
    }
  }
  return columns;
}

}  // namespace probebox::metrology
