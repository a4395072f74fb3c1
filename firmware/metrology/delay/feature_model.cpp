#include "firmware/metrology/delay/feature_model.hpp"

#include <Eigen/Geometry>
#include <cmath>

#include "firmware/metrology/fit/sphere.hpp"

namespace probebox::metrology {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

std::size_t index(Index i) {
  return static_cast<std::size_t>(i);
}

Vector3d motionOf(const SurfacePoint& point) {
  return (point.probe_velocity - point.article_velocity).normalized();
}

// Directions in which the readings determine the centre: all, across the axis, or along the common normal.
MatrixXd spanOf(const FeatureQuestion& question, std::span<const SurfacePoint> points) {
  if (question.shape == "plane" || question.shape == "plane-pair") return points.front().normal;
  if (question.shape != "cylinder") return Eigen::Matrix3d::Identity();
  MatrixXd across{3, 2};
  across.col(0) = question.axis.unitOrthogonal();
  across.col(1) = question.axis.cross(Vector3d{across.col(0)});
  return across;
}

}  // namespace

FeatureModel::FeatureModel(const FeatureQuestion& question, std::span<const SurfacePoint> points)
    : question_{question}, points_{points}, span_{spanOf(question, points)} {
  double outwards = 0.0;
  if (question.shape == "plane") return;
  Vector3d mean = Vector3d::Zero();
  for (const auto& point : points) mean += point.machine / static_cast<double>(points.size());
  for (const auto& point : points) outwards += (point.machine - mean).dot(point.normal);
  side_ = outwards < 0.0 ? -1.0 : 1.0;
}

MatrixXd FeatureModel::carried(const Vector3d& probe_velocity, const Vector3d& article_velocity) const {
  MatrixXd columns{3, question_.delayCount()};
  const Vector3d moved = probe_velocity - (question_.own_article ? Vector3d{Vector3d::Zero()} : article_velocity);
  if (question_.each_axis) {
    columns.leftCols<3>() = moved.asDiagonal();
  } else {
    columns.col(0) = moved;
  }
  if (question_.own_article) columns.rightCols<1>() = -article_velocity;
  return columns;
}

VectorXd FeatureModel::start() const {
  VectorXd at = VectorXd::Zero(parameters());
  MatrixXd rows{static_cast<Index>(points_.size()), dimensions()};
  for (Index i = 0; i < rows.rows(); ++i) rows.row(i) = (span_.transpose() * points_[index(i)].machine).transpose();
  at.head(dimensions()) = rows.colwise().mean().transpose();
  const auto ball = question_.sized() ? algebraicBall(rows) : std::nullopt;
  if (ball) at.head(dimensions()) = ball->centre;
  if (question_.sizeFree()) at[dimensions()] = ball ? ball->radius : 1.0;
  return at;
}

// Where the tip parts from the surface: at a threshold the stylus is still bent by that much, along the motion.
Vector3d FeatureModel::surfaceOf(const SurfacePoint& point, const VectorXd& at) const {
  const Vector3d pressed = question_.threshold_mm.value_or(0.0) * motionOf(point);
  return point.machine + pressed + carried(point) * at.tail(question_.delayCount());
}

// Extent of the feature from its centre to the touched point.
double FeatureModel::extent(const SurfacePoint& point, const VectorXd& at) const {
  if (question_.shape == "plane") return 0.0;
  if (question_.shape == "box") return 0.5 * side_ * question_.box_mm.dot(point.normal.cwiseAbs());
  return question_.size_mm ? 0.5 * *question_.size_mm : at[dimensions()];
}

Linearised FeatureModel::evaluate(const VectorXd& at, const VectorXd& weights) const {
  const auto n = static_cast<Index>(points_.size());
  Linearised model{VectorXd{n}, MatrixXd::Zero(n, parameters())};
  for (Index i = 0; i < n; ++i) {
    const SurfacePoint& point = points_[index(i)];
    const VectorXd arm = span_.transpose() * surfaceOf(point, at) - at.head(dimensions());
    const VectorXd direction =
        question_.sized() ? VectorXd{arm.normalized()} : VectorXd{span_.transpose() * point.normal};
    model.residuals[i] = direction.dot(arm) - extent(point, at);
    model.jacobian.row(i).head(dimensions()) = -direction.transpose();
    if (question_.sizeFree()) model.jacobian(i, dimensions()) = -1.0;
    model.jacobian.row(i).tail(question_.delayCount()) = (span_ * direction).transpose() * carried(point);
  }
  model.residuals.array() *= weights.array();
  model.jacobian = weights.asDiagonal() * model.jacobian;
  return model;
}

VectorXd FeatureModel::weightsAt(const VectorXd& at) const {
  VectorXd weights{static_cast<Index>(points_.size())};
  for (Index i = 0; i < weights.size(); ++i) {
    const SurfacePoint& point = points_[index(i)];
    const double seen = std::pow(motionOf(point).dot(point.normal), 2);
    const double lever = point.lever_s + at[delaysAt()];
    const double along = point.of_mean + lever * (2.0 * point.of_both + lever * point.of_slope);
    weights[i] = 1.0 / std::sqrt(seen * along + (1.0 - seen) * point.across);
  }
  return weights;
}

double FeatureModel::missingDepth(const SurfacePoint& point, const VectorXd& at) const {
  const VectorXd delays = at.tail(question_.delayCount());
  const Vector3d rest = point.apex + carried(point.article_velocity, point.article_velocity) * delays;
  return (surfaceOf(point, at) - rest).dot(motionOf(point)) - point.depth_mm;
}

}  // namespace probebox::metrology
