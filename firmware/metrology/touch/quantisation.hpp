#pragma once
#include <Eigen/Core>
#include <array>
#include <span>

#include "firmware/metrology/fit/line.hpp"

namespace probebox::metrology {

// Computes the effect of encoder quantisation on a line through positions. The error is a sawtooth of the position, and
// of time at constant speed. When a sample period is close to a whole number of steps, many samples have the same
// error, which shifts the line but hardly shows in its residuals. Noise before the quantisation smooths the sawtooth.
// Uses its harmonics with unit amplitude and unknown phase.
class QuantisationError {
 public:
  // Variances for one axis, mm^2 and s: of the line's mean and slope, of their common part, and of a residual averaged
  // over the degrees of freedom.
  struct Share {
    double mean{};
    double slope{};
    double both{};
    double residual{};
  };

  QuantisationError() = default;
  // times: of the line's samples. steps: resolution of each axis, mm, 0 if there is none.
  QuantisationError(std::span<const double> times, const Line& line, const Eigen::Vector3d& steps);

  // Variances for noise of this sd (mm, one axis, before quantisation).
  Share shareOf(Eigen::Index axis, double noise) const;
  // Variance of noise and quantisation that is independent for each sample.
  double ownVariance(Eigen::Index axis, double noise) const;
  double coarsest() const { return steps_.maxCoeff(); }
  // Covariance of a sample with the others.
  double commonVariance(Eigen::Index axis, double noise) const;

 private:
  static constexpr std::size_t kHarmonics = 20;
  double power(Eigen::Index axis, std::size_t harmonic, double noise) const;

  Eigen::Vector3d steps_ = Eigen::Vector3d::Zero();
  std::array<std::array<Share, kHarmonics>, 3> of_harmonic_{};  // of unit power
};

// sd of the noise before quantisation, mm, that explains the residuals of these lines along their motions. lines and
// roundings: one per line.
double noiseBeforeRounding(std::span<const Line> lines, std::span<const QuantisationError> roundings);

}  // namespace probebox::metrology
