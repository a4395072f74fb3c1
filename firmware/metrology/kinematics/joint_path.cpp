#include "firmware/metrology/kinematics/joint_path.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "firmware/metrology/fit/decompositions.hpp"

namespace probebox::metrology {
namespace {

using Eigen::Index;
using Eigen::Vector3d;
using Eigen::VectorXd;

constexpr double kOffLine = 5.0;  // deviations of a sample that the line does not use
constexpr double kRounding_mm = 1e-6;
constexpr double kBend = 4.0;  // deviations

// Coefficients of 1, s, s^2. The bend counts only where it stands out of its noise: else a line says more.
Vector3d parabola(const Eigen::MatrixXd& powers, const VectorXd& values) {
  const Vector3d bent = solveLeastSquares(powers, values);
  const double variance =
      (values - powers * bent).squaredNorm() / std::max(1.0, static_cast<double>(values.size() - 3));
  const Eigen::Matrix3d cofactor = inverse(Eigen::Matrix3d{powers.transpose() * powers});
  if (bent[2] * bent[2] > kBend * kBend * variance * cofactor(2, 2)) return bent;
  Vector3d straight = Vector3d::Zero();
  straight.head<2>() = solveLeastSquares(powers.leftCols(2), values);
  return straight;
}

}  // namespace

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

Vector3d shiftOf(const Kinematics& machine, const JointPath& path, double t, const VectorXd& later) {
  const VectorXd now = VectorXd::Constant(machine.size(), t);
  return machine.tip(path.at(now + later)) - machine.tip(path.at(now));
}

Eigen::Matrix3Xd dPointPerDelay(const Kinematics& machine, const JointPath& path, double t, const VectorXd& later) {
  const VectorXd times = VectorXd::Constant(machine.size(), t) + later;
  return machine.jacobian(path.at(times)) * path.rates(times).asDiagonal();
}

}  // namespace probebox::metrology
