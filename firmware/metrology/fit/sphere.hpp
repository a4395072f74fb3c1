#pragma once
#include <Eigen/Core>
#include <optional>

#include "firmware/metrology/dataset/result.hpp"
#include "firmware/metrology/fit/least_squares.hpp"
#include "firmware/metrology/fit/line.hpp"
#include "protocol/units/outcome.hpp"

namespace probebox::metrology {

// Algebraic circle or sphere through points in any number of dimensions (B1): rows of `points` are points.
// Exact without noise. Nothing when the points do not determine it.
struct Ball {
  Eigen::VectorXd centre;
  double radius{};
};
std::optional<Ball> algebraicBall(const Eigen::MatrixXd& points);

// Geometric fit (B2), (B3) to stylus-ball centres; fit.parameters: centre, then the radius unless it is known. mm.
// Refuses: too-few-readings (4 points, 3 with a known radius), duplicated-reading, coplanar (with a known radius points
// of one plane will do when the approximate centre tells on which side of it the sphere lies), and what leastSquares
// refuses.
struct SphereQuestion {
  double sigma{1.0};                                    // mm, of one coordinate (k = 1); 1 gives the cofactor
  std::optional<double> radius{};                       // mm, effective, when it is known
  std::optional<Eigen::Vector3d> approximate_centre{};  // mm
  Outliers outliers{Outliers::keep};
};
Outcome<Fit, Refusal> fitSphere(const Eigen::Ref<const Rows3>& points, const SphereQuestion& question);

}  // namespace probebox::metrology
