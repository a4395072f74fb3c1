#pragma once
#include <Eigen/Core>
#include <span>

#include "firmware/metrology/delay/feature_question.hpp"
#include "firmware/metrology/delay/surface_points.hpp"
#include "firmware/metrology/fit/least_squares.hpp"

namespace probebox::metrology {

// (A12) for a feature: the signed distance of every touch from it (CN101622513, docs/metrology.md A.6b). Parameters: c
// in the directions in which the feature has extent, R unless it is known, then the delays. Both arguments must outlive
// the model.
class FeatureModel {
 public:
  FeatureModel(const FeatureQuestion& question, std::span<const SurfacePoint> points);

  Eigen::Index dimensions() const { return question_.dimensions(); }
  Eigen::Index delaysAt() const { return parameters() - question_.delayCount(); }
  Eigen::Index parameters() const { return question_.unknowns(); }
  // 1 for a feature touched from outside, -1 from within.
  double side() const { return side_; }

  // T v as the factors of each delay, one column each.
  Eigen::MatrixXd carried(const Eigen::Vector3d& probe_velocity, const Eigen::Vector3d& article_velocity) const;
  Eigen::MatrixXd carried(const SurfacePoint& point) const {
    return carried(point.probe_velocity, point.article_velocity);
  }

  Eigen::VectorXd start() const;
  // weights: 1 / sd of each touch's distance. Residuals: measured minus fitted.
  Linearised evaluate(const Eigen::VectorXd& at, const Eigen::VectorXd& weights) const;
  // 1 / sd of the distances, which contain the velocity times the lever of the delay.
  Eigen::VectorXd weightsAt(const Eigen::VectorXd& at) const;
  // Difference between the machine's overtravel and the deflection at rest, mm.
  double missingDepth(const SurfacePoint& point, const Eigen::VectorXd& at) const;

 private:
  Eigen::Vector3d surfaceOf(const SurfacePoint& point, const Eigen::VectorXd& at) const;
  double extent(const SurfacePoint& point, const Eigen::VectorXd& at) const;

  const FeatureQuestion& question_;
  std::span<const SurfacePoint> points_;
  Eigen::MatrixXd span_;
  double side_{1.0};
};

}  // namespace probebox::metrology
