#include "firmware/metrology/touch/quantisation.hpp"

#include <algorithm>
#include <cmath>
#include <complex>

#include "protocol/units/angle.hpp"

namespace probebox::metrology {
namespace {

using Eigen::Index;

double square(double value) {
  return value * value;
}

// Variance of a residual along the motion.
double residualVariance(const Line& line, const QuantisationError& rounding, double noise) {
  const Eigen::Vector3d u = line.slope.normalized();
  double variance = 0.0;
  for (Index axis = 0; axis < 3; ++axis) {
    variance += square(u[axis]) * (rounding.ownVariance(axis, noise) + rounding.shareOf(axis, noise).residual);
  }
  return variance;
}

}  // namespace

QuantisationError::QuantisationError(std::span<const double> times, const Line& line, const Eigen::Vector3d& steps)
    : steps_{steps} {
  const auto n = static_cast<double>(line.n);
  for (Index axis = 0; axis < 3; ++axis) {
    if (steps[axis] <= 0.0) continue;
    std::array<std::complex<double>, kHarmonics> mean{};
    std::array<std::complex<double>, kHarmonics> slope{};
    for (const double time : times) {
      const double since = time - line.t_mean;
      const auto turned = std::polar(1.0, kTurn * line.slope[axis] * since / steps[axis]);
      std::complex<double> of_harmonic{1.0};
      for (std::size_t k = 0; k < kHarmonics; ++k) {
        of_harmonic *= turned;
        mean[k] += of_harmonic / n;
        slope[k] += of_harmonic * since / line.sxx;
      }
    }
    for (std::size_t k = 0; k < kHarmonics; ++k) {
      Share& share = of_harmonic_[static_cast<std::size_t>(axis)][k];
      share = {std::norm(mean[k]), std::norm(slope[k]), (mean[k] * std::conj(slope[k])).real(), 0.0};
      share.residual = (n - n * share.mean - line.sxx * share.slope) / (n - 2.0);
    }
  }
}

// Mean square of a harmonic of the sawtooth; normal noise leaves the exponential of it.
double QuantisationError::power(Index axis, std::size_t harmonic, double noise) const {
  const double turns = kTurn * static_cast<double>(harmonic + 1) / steps_[axis];
  return 2.0 / square(turns) * std::exp(-square(turns * noise));
}

QuantisationError::Share QuantisationError::shareOf(Index axis, double noise) const {
  Share all;
  if (steps_[axis] <= 0.0) return all;
  for (std::size_t k = 0; k < kHarmonics; ++k) {
    const Share& share = of_harmonic_[static_cast<std::size_t>(axis)][k];
    const double of_all = power(axis, k, noise);
    all.mean += of_all * share.mean;
    all.slope += of_all * share.slope;
    all.both += of_all * share.both;
    all.residual += of_all * share.residual;
  }
  return all;
}

double QuantisationError::ownVariance(Index axis, double noise) const {
  return square(noise) + square(steps_[axis]) / 12.0 - commonVariance(axis, noise);
}

double QuantisationError::commonVariance(Index axis, double noise) const {
  double variance = 0.0;
  for (std::size_t k = 0; steps_[axis] > 0.0 && k < kHarmonics; ++k) variance += power(axis, k, noise);
  return variance;
}

double noiseBeforeRounding(std::span<const Line> lines, std::span<const QuantisationError> roundings) {
  double found = 0.0;
  double dof = 0.0;
  for (const Line& line : lines) {
    found += line.scatterAlong(line.slope.normalized());
    dof += static_cast<double>(line.n) - 2.0;
  }
  const auto promised = [&](double noise) {
    double sum = 0.0;
    for (std::size_t k = 0; k < lines.size(); ++k) {
      sum += (static_cast<double>(lines[k].n) - 2.0) * residualVariance(lines[k], roundings[k], noise);
    }
    return sum;
  };
  double low = 0.0;
  double high = std::sqrt(found / dof);
  for (int step = 0; step < 40; ++step) {
    const double middle = 0.5 * (low + high);
    (promised(middle) < found ? low : high) = middle;
  }
  return 0.5 * (low + high);
}

}  // namespace probebox::metrology
