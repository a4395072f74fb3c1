#pragma once
#include <Eigen/Core>
#include <cstddef>
#include <optional>
#include <vector>

#include "firmware/metrology/dataset.hpp"
#include "firmware/metrology/least_squares.hpp"
#include "firmware/metrology/line.hpp"
#include "firmware/metrology/result.hpp"
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

// Method "sphere-fit": datum sphere centre and effective radius from touches (CN101976057, docs/metrology.md B.0).
// Table points{x_mm,y_mm,z_mm}. Config: sigma_mm; radius_mm when it is known; radius_min_mm, radius_max_mm;
// approximate_centre_mm; robust.
// Gives centre_mm, and radius_mm unless it is known. Refuses also: residual-too-large (4 sigma), radius-out-of-limits.
Outcome<Result, Refusal> solveSphereFit(const Dataset& dataset);

}  // namespace probebox::metrology
