#pragma once
#include <Eigen/Core>
#include <span>
#include <vector>

#include "firmware/metrology/least_squares.hpp"
#include "firmware/metrology/result.hpp"
#include "firmware/metrology/retract.hpp"
#include "protocol/units/outcome.hpp"

namespace probebox::metrology {

// Variance of one sample of a stream, along the motion and in either direction across it. Jitter of the stamps appears
// along the motion, and grows with the speed.
struct SampleNoise {
  double along{};
  double across{};
};
struct TouchNoise {
  SampleNoise machine;  // mm^2
  SampleNoise probe;    // raw^2
};

// Noise of every touch from the residuals of its lines, pooled over the touches of one nominal speed (over all touches
// where those are too few to tell). dof: of the residuals that were pooled, all together.
struct PooledNoise {
  std::vector<TouchNoise> of_touch;
  std::size_t dof{};
};
PooledNoise poolNoise(std::span<const Retract> retracts);

// Names of the touches whose own residuals are more than three times those of the others at its speed: slip or bounce.
std::vector<Dropped> noisyTouches(std::span<const Retract> retracts);

// How the probe's gain enters.
enum class Gain {
  common,    // one matrix A for all touches (A3): its slopes are pooled, and each touch needs only its mean deflection
  by_touch,  // each touch by its own slope (A6): where the gain depends on speed or direction
};

// The general touch model (CN101622513, docs/metrology.md (A12)): |M_i + tau v_i - c| = R over c, R and tau, with R
// free. The normals may span a space (sphere), a plane (circle) or a line (opposed touches); c lives in that span.
struct TouchFit {
  double tau_s{};
  double size_mm{};            // 2 R
  Eigen::Matrix2d covariance;  // of tau_s and size_mm, as the noise of the samples states it
  Eigen::VectorXd centre;      // mm, in the span of the normals: three numbers for a sphere
  Eigen::VectorXd centre_sd;
  Eigen::VectorXd radial;        // mm, one a touch: |M + tau v - c| - R
  Eigen::VectorXd normal_speed;  // mm/s, one a touch: outward
  double condition{};
  std::size_t dof{};           // of the radial residuals
  double radial_chi2{};        // reduced
  double slope_chi2{};         // reduced; of the slopes against one common gain. 0 with Gain::by_touch
  std::vector<double> worst;   // one a touch: largest weighted residual
  Eigen::VectorXd full_depth;  // mm, one a touch: radial residual of the point at rest at the apex; its deflection is
                               // complete when small
};

// Refuses: too-few-readings, one-sided, coplanar, and what leastSquares and fitSizeLine refuse.
Outcome<TouchFit, Refusal> fitTouches(std::span<const Retract> retracts, const PooledNoise& noise, Gain gain);

}  // namespace probebox::metrology
