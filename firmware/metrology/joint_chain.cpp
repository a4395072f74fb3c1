#include "firmware/metrology/joint_chain.hpp"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <Eigen/QR>
#include <algorithm>
#include <array>
#include <cmath>
#include <span>
#include <string_view>

#include "firmware/metrology/checks.hpp"
#include "firmware/metrology/table_columns.hpp"

namespace probebox::metrology {
namespace {

using Eigen::Index;
using Eigen::Vector3d;
using Eigen::VectorXd;

constexpr std::array<std::string_view, 7> kColumns{"revolute", "px_mm", "py_mm", "pz_mm", "ux", "uy", "uz"};
constexpr double kOffLine = 5.0;  // deviations of a sample that the line does not use
constexpr double kRounding_mm = 1e-6;
constexpr double kBend = 4.0;  // deviations

Vector3d turned(const Joint& joint, double angle, const Vector3d& at) {
  return joint.point + Eigen::AngleAxisd{angle, joint.direction} * (at - joint.point);
}

// Coefficients of 1, s, s^2. The bend counts only where it stands out of its noise: else a line says more.
Vector3d parabola(const Eigen::MatrixXd& powers, const VectorXd& values) {
  const Eigen::ColPivHouseholderQR<Eigen::MatrixXd> qr{powers};
  const Vector3d bent = qr.solve(values);
  const double variance =
      (values - powers * bent).squaredNorm() / std::max(1.0, static_cast<double>(values.size() - 3));
  const Eigen::Matrix3d cofactor = (powers.transpose() * powers).inverse();
  if (bent[2] * bent[2] > kBend * kBend * variance * cofactor(2, 2)) return bent;
  Vector3d straight = Vector3d::Zero();
  straight.head<2>() = powers.leftCols<2>().colPivHouseholderQr().solve(values);
  return straight;
}

}  // namespace

Outcome<JointChain, Refusal> JointChain::read(const Dataset& dataset) {
  const auto table = checkedTable(dataset, "chain", kColumns);
  if (!table) return table.error();
  const auto tip = requiredVector(dataset, "tip_mm");
  if (!tip) return tip.error();
  const Eigen::MatrixXd rows = columnsOf(*table.value(), kColumns);
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
  return JointChain{std::move(joints), Vector3d{tip->data()}};
}

std::vector<std::string> JointChain::columns() const {
  std::vector<std::string> names;
  for (const auto& joint : joints_) {
    names.push_back("q" + std::to_string(names.size() + 1) + (joint.revolute ? "_rad" : "_mm"));
  }
  return names;
}

Vector3d JointChain::tip(const VectorXd& q) const {
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

VectorXd JointPath::at(const VectorXd& times) const {
  const VectorXd s = (times.array() - t_mean) / half_s;
  return coefficients.col(0) + coefficients.col(1).cwiseProduct(s) + coefficients.col(2).cwiseProduct(s.cwiseAbs2());
}

VectorXd JointPath::rates(const VectorXd& times) const {
  const VectorXd s = (times.array() - t_mean) / half_s;
  return (coefficients.col(1) + 2.0 * coefficients.col(2).cwiseProduct(s)) / half_s;
}

JointPath fitJointPath(std::span<const double> times, const Eigen::MatrixXd& joints,
                       const Eigen::Ref<const Rows3>& positions, const Line& line) {
  JointPath path{
      .t_mean = line.t_mean, .half_s = std::sqrt(3.0 * line.sxx / static_cast<double>(line.n)), .coefficients = {}};
  const double deviation = std::sqrt(line.scatter.trace() / static_cast<double>(line.n));
  std::vector<Index> used;
  for (Index k = 0; k < joints.rows(); ++k) {
    const double t = times[static_cast<std::size_t>(k)];
    const double off = (positions.row(k).transpose() - line.at(t)).norm();
    if (std::abs(t - path.t_mean) <= path.half_s && off <= kOffLine * deviation + kRounding_mm) used.push_back(k);
  }
  Eigen::MatrixXd powers{static_cast<Index>(used.size()), 3};
  for (Index row = 0; row < powers.rows(); ++row) {
    const double t = times[static_cast<std::size_t>(used[static_cast<std::size_t>(row)])];
    const double s = (t - path.t_mean) / path.half_s;
    powers.row(row) << 1.0, s, s * s;
  }
  path.coefficients = Eigen::MatrixXd::Zero(joints.cols(), 3);
  for (Index k = 0; k < joints.cols(); ++k) {
    path.coefficients.row(k) = parabola(powers, joints(used, k)).transpose();
  }
  return path;
}

Vector3d shiftOf(const JointChain& chain, const JointPath& path, double t, const VectorXd& later) {
  const VectorXd now = VectorXd::Constant(chain.size(), t);
  return chain.tip(path.at(now + later)) - chain.tip(path.at(now));
}

Eigen::Matrix3Xd carriedBy(const JointChain& chain, const JointPath& path, double t, const VectorXd& later) {
  const VectorXd times = VectorXd::Constant(chain.size(), t) + later;
  return chain.jacobian(path.at(times)) * path.rates(times).asDiagonal();
}

}  // namespace probebox::metrology
