#pragma once
#include <Eigen/Core>
#include <optional>

#include "firmware/metrology/dataset/result.hpp"
#include "firmware/metrology/fit/least_squares.hpp"
#include "firmware/metrology/fit/line.hpp"
#include "protocol/units/outcome.hpp"

namespace probebox::metrology {

// Fits a circle or sphere algebraically in any number of dimensions (B1); each row of `points` is a point. Exact
// without noise; nullopt when the points do not determine it.
struct Ball {
  Eigen::VectorXd centre;
  double radius{};
};
std::optional<Ball> algebraicBall(const Eigen::MatrixXd& points);

// Fits a sphere geometrically (B2), (B3) to stylus-ball centres, mm; fit.parameters: centre, then the radius unless it
// is known. Refuses: too-few-readings (4 points, 3 with a known radius), duplicated-reading, coplanar (with a known
// radius a plane is enough if the approximate centre shows the side of the sphere), and what leastSquares refuses.
struct SphereQuestion {
  double sigma{1.0};                                    // mm, of one coordinate (k = 1); 1 gives the cofactor
  std::optional<double> radius{};                       // mm, effective, when it is known
  std::optional<Eigen::Vector3d> approximate_centre{};  // mm
  Outliers outliers{Outliers::keep};
};
Outcome<Fit, Refusal> fitSphere(const Eigen::Ref<const Rows3>& points, const SphereQuestion& question);

}  // namespace probebox::metrology
