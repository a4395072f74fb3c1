#include "firmware/metrology/touch/free_stylus.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <vector>

#include "firmware/metrology/dataset/configuration.hpp"
#include "firmware/metrology/fit/robust_statistics.hpp"
#include "firmware/metrology/touch/stamp_jitter.hpp"
#include "protocol/units/tolerances.hpp"

namespace probebox::metrology {
namespace {

constexpr double kLeastZero_mm = 0.001;
constexpr double kZeroDeviations = 5.0;
constexpr std::size_t kLeastFree = 8;
constexpr double kSurelyFree = 0.5;  // of a fall, after the separation: so late the stylus is free, whatever its zero
constexpr double kTouching = 0.10;   // of the largest deflection
constexpr double kMostAlike = 0.98;

// The samples that are surely off contact; none where the record has too few.
Run freeOf(const Stream& probe, const Parting& parting) {
  const auto later = std::ranges::lower_bound(probe.times, parting.at_s + kSurelyFree * parting.fall_s);
  const Run after{static_cast<std::size_t>(later - probe.times.begin()), probe.times.size()};
  if (after.size() >= kLeastFree) return after;
  const Eigen::VectorXd size = probe.values.rowwise().norm();
  const auto touching = std::ranges::find_if(size, [&](double one) { return one >= kTouching * size.maxCoeff(); });
  // The half of them that is further from the contact.
  const Run before{0, static_cast<std::size_t>(touching - size.begin()) / 2};
  return before.size() >= kLeastFree ? before : Run{};
}

struct FreeLevel {
  double value{};
  double sd{};
  double independent{};  // samples that would tell as much
};

// Median, and its sd as alike as neighbours are: what rings is no offset.
FreeLevel freeLevelOf(const std::vector<double>& values) {
  std::vector<double> sorted = values;
  const double level = median(sorted);
  double squares = 0.0, products = 0.0;
  for (std::size_t k = 0; k < values.size(); ++k) {
    squares += (values[k] - level) * (values[k] - level);
    if (k > 0) products += (values[k] - level) * (values[k - 1] - level);
  }
  const auto n = static_cast<double>(values.size());
  const double found = squares > 0.0 ? products / squares : 0.0;
  // What is found about the median of n values is too small by that (Kendall).
  const double alike = std::clamp(found + (1.0 + 4.0 * found) / n, 0.0, kMostAlike);
  const double sigma = std::sqrt(squares / n);
  constexpr double kOfMedian = 1.2533;  // sd of a median against that of a mean
  const double independent = n * (1.0 - alike) / (1.0 + alike);
  return {level, kOfMedian * sigma / std::sqrt(independent), independent};
}

}  // namespace

std::optional<Refusal> notAtZero(const Touch& touch, const Parting& parting) {
  const Run run = freeOf(touch.probe, parting);
  if (run.size() == 0) return std::nullopt;
  const Eigen::Vector3d steps = stepsOf(touch.probe);
  for (Eigen::Index k = 0; k < 3; ++k) {
    const std::vector<double> values = touch.probe.along(Eigen::Vector3d::Unit(k), run);
    const FreeLevel level = freeLevelOf(values);
    // Of few samples the sd itself is uncertain.
    const double deviations = kZeroDeviations * (1.0 + 4.0 / std::max(level.independent - 3.0, 0.5));
    // Rounding moves a steady reading by up to half a step.
    const double least = std::max(kLeastZero_mm * parting.units_per_mm, steps[k] + kCaseDigits);
    if (std::abs(level.value) <= std::max(least, deviations * level.sd)) continue;
    return Refusal{"probe-not-at-zero",
                   touch.plan.name + ": channel '" + std::string{column::kChannels[static_cast<std::size_t>(k)]} +
                       "' reads " + text(level.value) +
                       " while the stylus is free; let the probe rest free before the touch and subtract its zero"};
  }
  return std::nullopt;
}

}  // namespace probebox::metrology
