#pragma once
#include <Eigen/Core>
#include <array>
#include <span>

#include "firmware/metrology/fit/line.hpp"

namespace probebox::metrology {

// What the steps of an encoder do to a line through its positions. Rounding is a sawtooth of the position, and at
// constant speed a sawtooth of time. Where a period of the samples takes about a whole number of steps, many or all
// samples are rounded alike: that moves the line and hardly shows in its residuals. Noise before the rounding wears the
// sawtooth off. By harmonics of the sawtooth, of unit amplitude and unknown phase.
class Rounding {
 public:
  // Variances of one axis, mm^2 and s: of the line's mean and slope, what both share, and of a residual on average over
  // the degrees of freedom.
  struct Share {
    double mean{};
    double slope{};
    double both{};
    double residual{};
  };

  Rounding() = default;
  // times: of the line's samples. steps: mm, of each axis, 0 where there is none.
  Rounding(std::span<const double> times, const Line& line, const Eigen::Vector3d& steps);

  // What noise of this deviation (mm, of one axis, before rounding) leaves of it.
  Share shareOf(Eigen::Index axis, double noise) const;
  // Variance of noise and rounding that every sample has for itself.
  double ownVariance(Eigen::Index axis, double noise) const;
  double coarsest() const { return steps_.maxCoeff(); }
  // What the other samples share with a sample.
  double commonVariance(Eigen::Index axis, double noise) const;

 private:
  static constexpr std::size_t kHarmonics = 20;
  double power(Eigen::Index axis, std::size_t harmonic, double noise) const;

  Eigen::Vector3d steps_ = Eigen::Vector3d::Zero();
  std::array<std::array<Share, kHarmonics>, 3> of_harmonic_{};  // of unit power
};

// Deviation of the noise before rounding, mm, that makes the residuals along the motions of these lines what they are.
// lines and roundings: one each a line.
double noiseBeforeRounding(std::span<const Line> lines, std::span<const Rounding> roundings);

}  // namespace probebox::metrology
