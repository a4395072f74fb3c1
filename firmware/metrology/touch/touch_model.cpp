#include "firmware/metrology/touch/touch_model.hpp"

#include <algorithm>
#include <cmath>
#include <string>

#include "firmware/metrology/dataset/configuration.hpp"
#include "firmware/metrology/fit/decompositions.hpp"
#include "firmware/metrology/fit/sphere.hpp"
#include "firmware/metrology/touch/size_line.hpp"

namespace probebox::metrology {
namespace {

using Eigen::Index;
using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

// Least spread of deflections in a direction, relative to the largest; less is noise of the slopes.
constexpr double kFlatDeflections = 0.02;
constexpr double kLeastJoint = 0.02;  // of the speed, that a joint has to move the tip by

Matrix3d covarianceOf(const SampleNoise& noise, const Vector3d& motion) {
  const Vector3d u = motion.normalized();
  return noise.across * Matrix3d::Identity() + (noise.along - noise.across) * u * u.transpose();
}

}  // namespace

MatrixXd spanOf(const MatrixXd& rows, double flat) {
  const SingularSystem axes = singularSystem(rows);
  Index rank = 0;
  while (rank < axes.values.size() && axes.values[rank] > flat * axes.values[0]) ++rank;
  return axes.right.leftCols(rank);
}

Eigen::Matrix3Xd dPointPerDelay(const Retract& touch, const TouchQuestion& question, double t, const VectorXd& tau) {
  const Vector3d& slope = touch.machine.slope;
  if (question.delays == Delays::common) return slope;
  if (question.delays == Delays::each_axis) return Matrix3d{slope.asDiagonal()};
  const double common = tau.mean();
  const VectorXd apart = tau.array() - common;
  Eigen::Matrix3Xd carried = dPointPerDelay(*question.kinematics, touch.joints, t + common, apart);
  // Of the common part, which goes along the line.
  const Vector3d off_line =
      slope -
      dPointPerDelay(*question.kinematics, touch.joints, t + common, VectorXd::Zero(tau.size())).rowwise().sum();
  carried.colwise() += off_line / static_cast<double>(tau.size());
  return carried;
}

TouchModel::TouchModel(std::span<const Retract> retracts, const PooledNoise& noise, const TouchQuestion& question)
    : retracts_{retracts}, noise_{noise}, question_{question} {
  MatrixXd normals{size(), 3};
  MatrixXd deflections{size(), 3};
  for (Index i = 0; i < size(); ++i) {
    normals.row(i) = touch(i).plan.normal.transpose();
    deflections.row(i) = touch(i).probe.slope.normalized().transpose();
  }
  span_ = spanOf(normals);
  channels_ = spanOf(deflections, kFlatDeflections);
}

// With one delay for all joints it is the line, taken that much later; what theirs differ by moves it off the line.
Vector3d TouchModel::undelayed(Index i, const VectorXd& at) const {
  const Line& machine = touch(i).machine;
  const VectorXd tau = delays(at);
  if (question_.delays == Delays::each_axis) return machine.at(pointTime(i)) + tau.cwiseProduct(machine.slope);
  const double common = tau.mean();
  const Vector3d on_line = machine.at(pointTime(i) + common);
  if (question_.delays == Delays::common) return on_line;
  return on_line + shiftOf(*question_.kinematics, touch(i).joints, pointTime(i) + common, tau.array() - common);
}

Matrix3d TouchModel::gain(const VectorXd& at) const {
  return at.tail(3 * channels_.cols()).reshaped(3, channels_.cols()) * channels_.transpose();
}

Vector3d TouchModel::reach(Index i, const Vector3d& deflection, const VectorXd& at) const {
  if (question_.gain == Gain::common) return gain(at) * deflection;
  const Vector3d& slope = touch(i).probe.slope;
  return -touch(i).machine.slope * (deflection.dot(slope) / slope.squaredNorm());
}

double TouchModel::pointTime(Index i) const {
  return question_.gain == Gain::common ? touch(i).probe.t_mean : separationTime(touch(i).probe);
}

Vector3d TouchModel::point(Index i, const VectorXd& at) const {
  const Vector3d left = question_.gain == Gain::common ? reach(i, touch(i).probe.mean, at) : Vector3d{Vector3d::Zero()};
  return undelayed(i, at) + left;
}

// Share of the velocity's noise in the point: T of T v.
Matrix3d TouchModel::velocityShare(Index i, const VectorXd& at) const {
  const VectorXd tau = delays(at);
  if (question_.delays == Delays::each_axis) return tau.asDiagonal();
  const double common = tau.mean();
  Matrix3d share = common * Matrix3d::Identity();
  if (question_.delays == Delays::common) return share;
  const VectorXd times = VectorXd::Constant(tau.size(), pointTime(i) + common);
  const MatrixXd jacobian = question_.kinematics->jacobian(touch(i).joints.at(times));
  share += jacobian * (tau.array() - common).matrix().asDiagonal() * pseudoInverse(jacobian);
  return share;
}

// Covariance of one probe sample, seen in machine axes.
Matrix3d TouchModel::deflectionCovariance(Index i, const VectorXd& at) const {
  const Matrix3d raw = covarianceOf(noiseOf(i).probe, touch(i).probe.slope);
  Matrix3d a;
  for (Index k = 0; k < 3; ++k) a.col(k) = reach(i, Vector3d::Unit(k), at);
  return a * raw * a.transpose();
}

Eigen::Matrix4d TouchModel::covariance(Index i, const VectorXd& at) const {
  const auto& machine = touch(i).machine;
  const auto& probe = touch(i).probe;
  const Matrix3d of_machine = covarianceOf(noiseOf(i).machine, machine.slope);
  const Matrix3d of_probe = deflectionCovariance(i, at);
  const Vector3d n = span_ * outwards(i, point(i, at), at);
  // The radial residual holds the velocity with the lever of the extrapolation and of the delay.
  const Vector3d lever = velocityShare(i, at).transpose() * n + (pointTime(i) - machine.t_mean) * n;
  const auto& [of_position, of_deflection, rounded] = noiseOf(i);
  const double of_mean = of_position.of_mean / static_cast<double>(machine.n);
  const double of_slope = of_position.of_slope / machine.sxx;
  double radial = n.dot(of_machine * n) * of_mean + lever.dot(of_machine * lever) * of_slope +
                  n.dot(of_probe * n) * of_deflection.of_mean / static_cast<double>(probe.n);
  radial += n.cwiseAbs2().dot(rounded.mean) + lever.cwiseAbs2().dot(rounded.slope) +
            2.0 * n.cwiseProduct(lever).dot(rounded.both);
  if (question_.gain == Gain::by_touch)
    radial += n.dot(of_probe * n) * std::pow(pointTime(i) - probe.t_mean, 2) * of_deflection.of_slope / probe.sxx;
  Eigen::Matrix4d all;
  all.topLeftCorner<3, 3>() = of_machine * of_slope + of_probe * of_deflection.of_slope / probe.sxx;
  all.topLeftCorner<3, 3>().diagonal() += rounded.slope;
  all.topRightCorner<3, 1>() =
      of_machine * lever * of_slope + rounded.slope.cwiseProduct(lever) + rounded.both.cwiseProduct(n);
  all.bottomLeftCorner<1, 3>() = all.topRightCorner<3, 1>().transpose();
  all(3, 3) = radial;
  return all;
}

// Outward displacement of the touched points by each delay, per second and per speed of the fastest touch.
MatrixXd TouchModel::carriedOutwards() const {
  double fastest = 0.0;
  for (Index i = 0; i < size(); ++i) fastest = std::max(fastest, touch(i).plan.speed_mm_s);
  MatrixXd carried{size(), question_.delayCount()};
  for (Index i = 0; i < size(); ++i) {
    const TouchPlan& plan = touch(i).plan;
    if (question_.delays == Delays::each_joint) {
      const VectorXd none = VectorXd::Zero(question_.delayCount());
      carried.row(i) = plan.normal.transpose() * dPointPerDelay(touch(i), question_, pointTime(i), none) / fastest;
    } else {
      carried.row(i) = plan.speed_mm_s / fastest * plan.normal.cwiseProduct(plan.retract).transpose();
    }
  }
  return carried;
}

// Whether the touched sides do not tell centre from size, or from the delay of each axis. With a known size and one
// delay the size stands for the delay: all touches retract outwards.
bool TouchModel::oneSided(const MatrixXd& carried) const {
  MatrixXd rows{size(), dimensions() + carried.cols()};
  for (Index i = 0; i < size(); ++i) {
    rows.row(i).head(dimensions()) = (span_.transpose() * touch(i).plan.normal).transpose();
  }
  rows.rightCols(carried.cols()) = carried;
  const VectorXd singular = singularValues(rows);
  return rows.rows() < rows.cols() || singular[singular.size() - 1] < kFlat * singular[0];
}

std::optional<Refusal> TouchModel::withoutPose(double later) const {
  if (question_.delays != Delays::each_joint) return std::nullopt;
  const VectorXd joint_times = VectorXd::Constant(question_.delayCount(), later);
  for (Index i = 0; i < size(); ++i) {
    const VectorXd times = joint_times.array() + pointTime(i);
    if (question_.kinematics->reached(touch(i).joints.at(times))) continue;
    return Refusal{"not-reachable", touch(i).plan.name + ": with a delay of " + text(later) +
                                        " s the joints would be where the platform has no pose: compare "
                                        "effective_diameter_mm with the sphere"};
  }
  return std::nullopt;
}

// Two speeds serve as well as two sides (A11), where there is more than one delay.
std::optional<Refusal> TouchModel::dependentDelays() const {
  if (question_.delays == Delays::common) {
    if (!oneSided(VectorXd::Ones(size()))) return std::nullopt;
    return Refusal{"one-sided",
                   "the touched normals do not determine a size: touch opposite sides, or five sides of a sphere"};
  }
  MatrixXd carried = carriedOutwards();
  if (question_.delays == Delays::each_axis) {
    if (!oneSided(carried)) return std::nullopt;
    return Refusal{"one-sided",
                   "the touched normals do not determine the delay of every axis: touch both sides on x, y and z, or "
                   "at two speeds where there is no opposite side"};
  }
  for (Index k = 0; k < carried.cols(); ++k) {
    const double most = carried.col(k).cwiseAbs().maxCoeff();
    if (most < kLeastJoint) {
      return Refusal{"joint-not-moved", "joint " + std::to_string(k + 1) +
                                            " hardly moves the tip in any touch, so its delay is not determined: touch "
                                            "where it has to move, or ask for one common delay"};
    }
    carried.col(k) /= most;
  }
  if (!oneSided(carried)) return std::nullopt;
  return Refusal{"one-sided",
                 "the touches cannot separate the delays of the joints: touch opposite sides of the sphere, at two "
                 "speeds, or where the machine stands otherwise"};
}

// Points by each touch's own slope give the centre without the delay; the sizes give the delay: against the known one
// (A9), or at their speeds (A10).
Outcome<VectorXd, Refusal> TouchModel::start() const {
  if (auto refusal = withoutPose(0.0)) return *refusal;
  if (auto refusal = dependentDelays()) return *refusal;
  MatrixXd points{size(), dimensions()};
  MatrixXd slopes{size(), channels_.cols()};
  MatrixXd velocities{size(), 3};
  for (Index i = 0; i < size(); ++i) {
    const Vector3d inwards = question_.shape.beyond_mm(touch(i).plan.normal) * touch(i).plan.normal;
    points.row(i) = (span_.transpose() * (separationPoint(touch(i).machine, touch(i).probe) - inwards)).transpose();
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
  VectorXd at = VectorXd::Zero(parameters());
  at.head(dimensions()) = ball->centre;
  auto delays = at.segment(tauAt(), question_.delayCount());
  if (question_.size_mm) {
    delays.setConstant(delayOfKnownSize(*question_.size_mm, sizes));
  } else {
    TRY(const auto line, fitSizeLine(sizes));
    delays.setConstant(line.tau_s);
    at[dimensions()] = line.size_mm / 2.0;
  }
  if (auto refusal = withoutPose(delays[0])) return *refusal;
  if (question_.gain == Gain::common) {
    const MatrixXd a = solveLeastSquares(slopes, -velocities).transpose();
    at.tail(a.size()) = a.reshaped();
  }
  return at;
}

void TouchModel::weighAt(const VectorXd& at) {
  factor_.clear();
  for (Index i = 0; i < size(); ++i) {
    Eigen::Matrix4d all = covariance(i, at);
    if (question_.gain == Gain::by_touch) all = all(3, 3) * Eigen::Matrix4d::Identity();
    factor_.emplace_back(lowerCholesky(all));
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
    const VectorXd outward = outwards(i, point(i, at), at);
    const Vector3d n = span_ * outward;
    residual[3] = off_mm(i, point(i, at), at);
    jacobian.row(3).head(dimensions()) = -outward.transpose();
    if (!question_.size_mm) jacobian(3, dimensions()) = -1.0;
    jacobian.row(3).segment(tauAt(), question_.delayCount()) =
        n.transpose() * dPointPerDelay(touch(i), question_, pointTime(i), delays(at));
    if (question_.gain == Gain::common) {
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

MatrixXd TouchModel::perShift(const Fit& fit) const {
  const MatrixXd jacobian = (*this)(fit.parameters).jacobian;
  MatrixXd changes{parameters(), size()};
  for (Index i = 0; i < size(); ++i) {
    const double radial_sd = factor_[static_cast<std::size_t>(i)](3, 3);
    const VectorXd direction = outwards(i, point(i, fit.parameters), fit.parameters);
    const double outward = direction.dot(span_.transpose() * touch(i).plan.normal);
    changes.col(i) = -outward / radial_sd * fit.cofactor * jacobian.row(rowsOfTouch() * (i + 1) - 1).transpose();
  }
  return changes;
}

VectorXd TouchModel::radial(const VectorXd& at) const {
  VectorXd residuals{size()};
  for (Index i = 0; i < size(); ++i) residuals[i] = off_mm(i, point(i, at), at);
  return residuals;
}

VectorXd TouchModel::normalSpeed(const VectorXd& at) const {
  VectorXd speeds{size()};
  for (Index i = 0; i < size(); ++i) {
    speeds[i] = touch(i).machine.slope.dot(span_ * outwards(i, point(i, at), at));
  }
  return speeds;
}

VectorXd TouchModel::radialAtApex(const VectorXd& at) const {
  VectorXd residuals{size()};
  for (Index i = 0; i < size(); ++i) {
    const Vector3d tip = touch(i).machine_apex + reach(i, touch(i).probe_apex, at);
    residuals[i] = off_mm(i, tip, at);
  }
  return residuals;
}

}  // namespace probebox::metrology
