#pragma once
#include <Eigen/Core>
#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "firmware/metrology/dataset/result.hpp"
#include "firmware/metrology/touch/retract.hpp"
#include "firmware/metrology/touch/touch_model.hpp"
#include "firmware/metrology/touch/touch_noise.hpp"
#include "protocol/units/outcome.hpp"

namespace probebox::metrology {

// Fit of the general touch model (CN101622513, docs/metrology.md (A12)): |M_i + T v_i - c| = R over c, tau and, unless
// it is known, R. The normals may span space (sphere), a plane (circle) or a line (opposed faces); c lies in that span.
struct TouchFit {
  Eigen::VectorXd tau_s;  // one, or one per axis
  double size_mm{};       // 2 R, known or fitted
  // Covariance of tau_s, centre and, if fitted, size_mm, from the noise of the samples.
  Eigen::MatrixXd covariance;
  // Change of the same, a row each, when one touch, a column each, lies 1 mm further along its normal.
  Eigen::MatrixXd per_shift;
  Eigen::VectorXd centre;  // mm, in the span of the normals: three numbers for a sphere
  Eigen::VectorXd centre_sd;
  std::optional<Eigen::Matrix3d> gain;  // A (A3), when it is common and the deflections span space
  Eigen::Matrix3d gain_sd;
  Eigen::VectorXd radial;        // mm, one a touch: |M + T v - c| - R
  Eigen::VectorXd normal_speed;  // mm/s, one per touch: outward
  double condition{};
  std::size_t dof{};           // of the radial residuals
  double radial_chi2{};        // reduced
  std::size_t slope_dof{};     // of the slopes against one common gain. 0 with Gain::by_touch
  double slope_chi2{};         // reduced
  std::vector<double> worst;   // one a touch: largest weighted residual
  Eigen::VectorXd full_depth;  // mm, one per touch: radial residual of the point at rest at the apex; its deflection is
                               // complete when small
};

// Refuses: too-few-readings, one-sided, coplanar, not-reachable, and what leastSquares and fitSizeLine refuse.
Outcome<TouchFit, Refusal> fitTouches(std::span<const Retract> retracts, const PooledNoise& noise,
                                      const TouchQuestion& question);

}  // namespace probebox::metrology
