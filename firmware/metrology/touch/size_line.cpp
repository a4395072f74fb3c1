#include "firmware/metrology/touch/size_line.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "firmware/metrology/dataset/configuration.hpp"

namespace probebox::metrology {

std::optional<Refusal> refuseSpeeds(double least, double greatest) {
  const double fastest = std::max(std::abs(least), std::abs(greatest));
  const double span = greatest - least;
  if (!(span > 1e-3 * fastest)) {
    return Refusal{"single-speed",
                   "all touches ran at one speed: delay and size cannot be told apart; repeat the touches at "
                   "a second speed, or use delay-known-sphere"};
  }
  if (span < 0.2 * fastest) {
    return Refusal{"speeds-too-close", "the speeds differ by " + text(100.0 * span / fastest) +
                                           " % of the fastest, 20 % are needed; add a slower or a faster one"};
  }
  return std::nullopt;
}

Outcome<SizeLine, Refusal> fitSizeLine(std::span<const SizeAtSpeed> sizes) {
  double least = std::numeric_limits<double>::infinity();
  double greatest = -least;
  double weights = 0.0;
  double mean_speed = 0.0;
  double mean_size = 0.0;
  for (const auto& at : sizes) {
    least = std::min(least, at.normal_speeds_mm_s);
    greatest = std::max(greatest, at.normal_speeds_mm_s);
    weights += 1.0 / at.variance;
    mean_speed += at.normal_speeds_mm_s / at.variance;
    mean_size += at.size_mm / at.variance;
  }
  mean_speed /= weights;
  mean_size /= weights;
  if (auto refusal = refuseSpeeds(least, greatest)) return *refusal;
  double sxx = 0.0;
  double sxy = 0.0;
  for (const auto& at : sizes) {
    sxx += std::pow(at.normal_speeds_mm_s - mean_speed, 2) / at.variance;
    sxy += (at.normal_speeds_mm_s - mean_speed) * (at.size_mm - mean_size) / at.variance;
  }
  SizeLine line;
  line.tau_s = -sxy / sxx;
  line.size_mm = mean_size + line.tau_s * mean_speed;
  line.tau_variance = 1.0 / sxx;
  line.size_variance = 1.0 / weights + mean_speed * mean_speed / sxx;
  line.covariance = mean_speed / sxx;
  for (const auto& at : sizes) {
    line.chi2_reduced += std::pow(at.size_mm - line.size_mm + line.tau_s * at.normal_speeds_mm_s, 2) / at.variance;
  }
  line.chi2_reduced = sizes.size() > 2 ? line.chi2_reduced / static_cast<double>(sizes.size() - 2) : 0.0;
  return line;
}

double delayOfKnownSize(double size_mm, std::span<const SizeAtSpeed> sizes) {
  double sxx = 0.0;
  double sxy = 0.0;
  for (const auto& at : sizes) {
    sxx += at.normal_speeds_mm_s * at.normal_speeds_mm_s / at.variance;
    sxy += at.normal_speeds_mm_s * (size_mm - at.size_mm) / at.variance;
  }
  return sxy / sxx;
}

}  // namespace probebox::metrology
