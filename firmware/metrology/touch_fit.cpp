#include "firmware/metrology/touch_fit.hpp"

#include <Eigen/Cholesky>
#include <Eigen/QR>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <map>
#include <string>

#include "firmware/metrology/size_line.hpp"
#include "firmware/metrology/sphere_fit.hpp"

namespace probebox::metrology {
namespace {

using Eigen::Index;
using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

// Directions closer together than about three degrees count as one.
constexpr double kSpanLimit = 0.05;

// Orthonormal columns that span the rows (unit vectors).
MatrixXd spanOf(const MatrixXd& rows) {
  const Eigen::JacobiSVD<MatrixXd> svd{rows, Eigen::ComputeThinV};
  Index rank = 0;
  while (rank < svd.singularValues().size() && svd.singularValues()[rank] > kSpanLimit * svd.singularValues()[0])
    ++rank;
  return svd.matrixV().leftCols(rank);
}

Matrix3d covarianceOf(const SampleNoise& noise, const Vector3d& motion) {
  const Vector3d u = motion.normalized();
  return noise.across * Matrix3d::Identity() + (noise.along - noise.across) * u * u.transpose();
}

// Parameters: c in the span of the normals, R, tau, then (common gain) A on the span of the deflections, column by
// column.
class TouchModel {
 public:
  TouchModel(std::span<const Retract> retracts, const PooledNoise& noise, Gain gain)
      : retracts_{retracts}, noise_{noise}, gain_{gain} {
    MatrixXd normals{size(), 3};
    MatrixXd deflections{size(), 3};
    for (Index i = 0; i < size(); ++i) {
      normals.row(i) = touch(i).plan.normal.transpose();
      deflections.row(i) = touch(i).probe.slope.normalized().transpose();
    }
    span_ = spanOf(normals);
    channels_ = spanOf(deflections);
  }

  Index size() const { return static_cast<Index>(retracts_.size()); }
  Index dimensions() const { return span_.cols(); }
  Index rowsOfTouch() const { return gain_ == Gain::common ? 4 : 1; }
  const MatrixXd& span() const { return span_; }
  Index radiusAt() const { return dimensions(); }
  Index tauAt() const { return dimensions() + 1; }
  Index gainAt() const { return dimensions() + 2; }
  Index parameters() const { return gainAt() + (gain_ == Gain::common ? 3 * channels_.cols() : 0); }

  Outcome<VectorXd, Refusal> start() const;
  // Weights depend, weakly, on the answer: they are taken at a given one.
  void weighAt(const VectorXd& at);
  Linearised operator()(const VectorXd& at) const;
  VectorXd radial(const VectorXd& at) const;
  VectorXd normalSpeed(const VectorXd& at) const;
  VectorXd radialAtApex(const VectorXd& at) const;

 private:
  const Retract& touch(Index i) const { return retracts_[static_cast<std::size_t>(i)]; }
  const TouchNoise& noiseOf(Index i) const { return noise_.of_touch[static_cast<std::size_t>(i)]; }
  // A deflection in machine axes, mm: A d (A3), or along the motion by the touch's own gain.
  Vector3d reach(Index i, const Vector3d& deflection, const VectorXd& at) const;
  Matrix3d deflectionCovariance(Index i, const VectorXd& at) const;
  // Machine time of the probe's line at which the point is taken, and the deflection left there.
  double pointTime(Index i) const;
  Vector3d point(Index i, const VectorXd& at) const;
  VectorXd arm(const Vector3d& point, const VectorXd& at) const {
    return span_.transpose() * point - at.head(dimensions());
  }
  Eigen::Matrix4d covariance(Index i, const VectorXd& at) const;

  std::span<const Retract> retracts_;
  const PooledNoise& noise_;
  Gain gain_;
  MatrixXd span_;                        // 3 x dimensions
  MatrixXd channels_;                    // 3 x directions of deflection
  std::vector<Eigen::Matrix4d> factor_;  // lower Cholesky factors: slope (3), radial (1)
};

Vector3d TouchModel::reach(Index i, const Vector3d& deflection, const VectorXd& at) const {
  if (gain_ == Gain::common) {
    const MatrixXd a = at.tail(3 * channels_.cols()).reshaped(3, channels_.cols());
    return a * (channels_.transpose() * deflection);
  }
  const Vector3d& slope = touch(i).probe.slope;
  return -touch(i).machine.slope * (deflection.dot(slope) / slope.squaredNorm());
}

double TouchModel::pointTime(Index i) const {
  return gain_ == Gain::common ? touch(i).probe.t_mean : separationTime(touch(i).probe);
}

Vector3d TouchModel::point(Index i, const VectorXd& at) const {
  const Vector3d undeflected = touch(i).machine.at(pointTime(i));
  const Vector3d left = gain_ == Gain::common ? reach(i, touch(i).probe.mean, at) : Vector3d::Zero();
  return undeflected + left + at[tauAt()] * touch(i).machine.slope;
}

// Covariance of one probe sample, seen in machine axes.
Matrix3d TouchModel::deflectionCovariance(Index i, const VectorXd& at) const {
  const Matrix3d raw = covarianceOf(noiseOf(i).probe, touch(i).probe.slope);
  Matrix3d a;
  for (Index k = 0; k < 3; ++k) a.col(k) = reach(i, Vector3d::Unit(k), at);
  return a * raw * a.transpose();
}

// Of the slope residual A ddot + v and of the radial residual; both hold the velocity, hence the cross term.
Eigen::Matrix4d TouchModel::covariance(Index i, const VectorXd& at) const {
  const auto& machine = touch(i).machine;
  const auto& probe = touch(i).probe;
  const Matrix3d of_machine = covarianceOf(noiseOf(i).machine, machine.slope);
  const Matrix3d of_probe = deflectionCovariance(i, at);
  const Vector3d n = span_ * arm(point(i, at), at).normalized();
  const double lever = pointTime(i) - machine.t_mean + at[tauAt()];
  const double along_n = n.dot(of_machine * n);
  double radial = along_n / static_cast<double>(machine.n) + along_n * lever * lever / machine.sxx +
                  n.dot(of_probe * n) / static_cast<double>(probe.n);
  if (gain_ == Gain::by_touch) radial += n.dot(of_probe * n) * std::pow(pointTime(i) - probe.t_mean, 2) / probe.sxx;
  Eigen::Matrix4d all;
  all.topLeftCorner<3, 3>() = of_machine / machine.sxx + of_probe / probe.sxx;
  all.topRightCorner<3, 1>() = of_machine * n * (lever / machine.sxx);
  all.bottomLeftCorner<1, 3>() = all.topRightCorner<3, 1>().transpose();
  all(3, 3) = radial;
  return all;
}

// Centre and radius can be told apart only when the normals do not all point to one side.
bool oneSided(const MatrixXd& span, std::span<const Retract> retracts) {
  MatrixXd rows{static_cast<Index>(retracts.size()), span.cols() + 1};
  for (Index i = 0; i < rows.rows(); ++i) {
    rows.row(i) << (span.transpose() * retracts[static_cast<std::size_t>(i)].plan.normal).transpose(), 1.0;
  }
  const VectorXd singular = Eigen::JacobiSVD<MatrixXd>{rows}.singularValues();
  return rows.rows() < rows.cols() || singular[singular.size() - 1] < kSpanLimit * singular[0];
}

// Points by each touch's own slope give the centre without the delay, the sizes at their speeds give delay and size
// (A10).
Outcome<VectorXd, Refusal> TouchModel::start() const {
  if (oneSided(span_, retracts_)) {
    return Refusal{"one-sided",
                   "the touched normals do not determine a size: touch opposite sides, or five sides of a sphere"};
  }
  MatrixXd points{size(), dimensions()};
  MatrixXd slopes{size(), channels_.cols()};
  MatrixXd velocities{size(), 3};
  for (Index i = 0; i < size(); ++i) {
    points.row(i) = (span_.transpose() * separationPoint(touch(i).machine, touch(i).probe)).transpose();
    slopes.row(i) = (channels_.transpose() * touch(i).probe.slope).transpose();
    velocities.row(i) = touch(i).machine.slope.transpose();
  }
  const auto ball = algebraicBall(points);
  if (!ball) {
    return Refusal{"coplanar",
                   "the touched points do not determine a size: touch opposite sides, or five sides of a sphere"};
  }
  std::vector<SizeAtSpeed> sizes;
  for (Index i = 0; i < size(); ++i) {
    const VectorXd from_centre = points.row(i).transpose() - ball->centre;
    const double normal_speed = touch(i).machine.slope.dot(span_ * from_centre.normalized());
    sizes.push_back({2.0 * normal_speed, 2.0 * from_centre.norm(), 1.0});
  }
  const auto line = fitSizeLine(sizes);
  if (!line) return line.error();
  VectorXd at = VectorXd::Zero(parameters());
  at.head(dimensions()) = ball->centre;
  at[radiusAt()] = line->size_mm / 2.0;
  at[tauAt()] = line->tau_s;
  if (gain_ == Gain::common) {
    const MatrixXd a = slopes.colPivHouseholderQr().solve(-velocities).transpose();
    at.tail(a.size()) = a.reshaped();
  }
  return at;
}

void TouchModel::weighAt(const VectorXd& at) {
  factor_.clear();
  for (Index i = 0; i < size(); ++i) {
    Eigen::Matrix4d all = covariance(i, at);
    if (gain_ == Gain::by_touch) all = all(3, 3) * Eigen::Matrix4d::Identity();
    factor_.push_back(all.llt().matrixL());
  }
}

Linearised TouchModel::operator()(const VectorXd& at) const {
  const Index rows = rowsOfTouch();
  Linearised model{VectorXd{rows * size()}, MatrixXd::Zero(rows * size(), parameters())};
  for (Index i = 0; i < size(); ++i) {
    const auto& machine = touch(i).machine;
    const auto& probe = touch(i).probe;
    Eigen::Vector4d residual = Eigen::Vector4d::Zero();
    MatrixXd jacobian = MatrixXd::Zero(4, parameters());
    const VectorXd from_centre = arm(point(i, at), at);
    const Vector3d n = span_ * from_centre.normalized();
    residual[3] = from_centre.norm() - at[radiusAt()];
    jacobian.row(3).head(dimensions()) = -from_centre.normalized().transpose();
    jacobian(3, radiusAt()) = -1.0;
    jacobian(3, tauAt()) = n.dot(machine.slope);
    if (gain_ == Gain::common) {
      residual.head<3>() = reach(i, probe.slope, at) + machine.slope;
      for (Index k = 0; k < channels_.cols(); ++k) {
        jacobian.block<3, 3>(0, gainAt() + 3 * k) = channels_.col(k).dot(probe.slope) * Matrix3d::Identity();
        jacobian.block<1, 3>(3, gainAt() + 3 * k) = channels_.col(k).dot(probe.mean) * n.transpose();
      }
    }
    const auto lower = factor_[static_cast<std::size_t>(i)].triangularView<Eigen::Lower>();
    lower.solveInPlace(residual);
    lower.solveInPlace(jacobian);
    model.residuals.segment(rows * i, rows) = residual.tail(rows);
    model.jacobian.middleRows(rows * i, rows) = jacobian.bottomRows(rows);
  }
  return model;
}

VectorXd TouchModel::radial(const VectorXd& at) const {
  VectorXd residuals{size()};
  for (Index i = 0; i < size(); ++i) residuals[i] = arm(point(i, at), at).norm() - at[radiusAt()];
  return residuals;
}

VectorXd TouchModel::normalSpeed(const VectorXd& at) const {
  VectorXd speeds{size()};
  for (Index i = 0; i < size(); ++i) {
    speeds[i] = touch(i).machine.slope.dot(span_ * arm(point(i, at), at).normalized());
  }
  return speeds;
}

VectorXd TouchModel::radialAtApex(const VectorXd& at) const {
  VectorXd residuals{size()};
  for (Index i = 0; i < size(); ++i) {
    const Vector3d tip = touch(i).machine_apex + reach(i, touch(i).probe_apex, at);
    residuals[i] = arm(tip, at).norm() - at[radiusAt()];
  }
  return residuals;
}

Outcome<Fit, Refusal> settle(TouchModel& model) {
  const auto start = model.start();
  if (!start) return start.error();
  model.weighAt(start.value());
  const auto first = leastSquares(model, start.value());
  if (!first) return first;
  model.weighAt(first->parameters);
  return leastSquares(model, first->parameters);
}

void shareOut(TouchFit& result, const TouchModel& model, const Fit& fit) {
  const Index rows = model.rowsOfTouch();
  double radial = 0.0;
  double slope = 0.0;
  for (Index i = 0; i < model.size(); ++i) {
    const VectorXd of_touch = fit.residuals.segment(rows * i, rows);
    slope += of_touch.head(rows - 1).squaredNorm();
    radial += std::pow(of_touch[rows - 1], 2);
    result.worst.push_back(of_touch.cwiseAbs().maxCoeff());
  }
  result.dof = static_cast<std::size_t>(model.size() - model.gainAt());
  if (result.dof > 0) result.radial_chi2 = radial / static_cast<double>(result.dof);
  const Index slope_dof = (rows - 1) * model.size() - (model.parameters() - model.gainAt());
  if (slope_dof > 0) result.slope_chi2 = slope / static_cast<double>(slope_dof);
}

}  // namespace

Outcome<TouchFit, Refusal> fitTouches(std::span<const Retract> retracts, const PooledNoise& noise, Gain gain) {
  if (retracts.empty()) return Refusal{"too-few-readings", "no touch is left to fit: measure again"};
  TouchModel model{retracts, noise, gain};
  if (model.size() < model.gainAt()) {
    return Refusal{"too-few-readings", std::to_string(model.size()) + " touches for " + std::to_string(model.gainAt()) +
                                           " unknowns: touch more sides, or at more speeds"};
  }
  const auto fit = settle(model);
  if (!fit) return fit.error();
  const VectorXd& at = fit->parameters;
  TouchFit result;
  result.tau_s = at[model.tauAt()];
  result.size_mm = 2.0 * at[model.radiusAt()];
  const std::vector<Index> wanted{model.tauAt(), model.radiusAt()};
  const Eigen::Vector2d to_size{1.0, 2.0};
  result.covariance = to_size.asDiagonal() * fit->cofactor(wanted, wanted) * to_size.asDiagonal();
  result.centre = at.head(model.dimensions());
  if (model.dimensions() == 3) result.centre = model.span() * result.centre;
  result.centre_sd =
      (model.span() * fit->cofactor.topLeftCorner(model.dimensions(), model.dimensions()) * model.span().transpose())
          .diagonal()
          .cwiseMax(0.0)
          .cwiseSqrt();
  result.radial = model.radial(at);
  result.normal_speed = model.normalSpeed(at);
  result.full_depth = model.radialAtApex(at);
  result.condition = fit->condition;
  shareOut(result, model, fit.value());
  return result;
}

}  // namespace probebox::metrology
