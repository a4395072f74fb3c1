#include "firmware/metrology/scan/quantised_legs.hpp"

#include <algorithm>
#include <utility>
#include <vector>

#include "firmware/metrology/fit/line.hpp"
#include "firmware/metrology/touch/despiking.hpp"
#include "firmware/metrology/touch/quantisation.hpp"
#include "firmware/metrology/touch/stamp_jitter.hpp"

namespace probebox::metrology {
namespace {

using Eigen::Index;

constexpr std::size_t kLeastOfRun = 4;
constexpr double kLeastShare = 0.05;  // of the residuals' variance, that the steps' may be worth looking at

struct Leg {
  Run run;  // of all samples; the line is without spikes
  Line line;
  QuantisationError rounding;
};

Run runBetween(const std::vector<double>& times, double from, double until) {
  const auto begin = std::ranges::lower_bound(times, from) - times.begin();
  const auto end = std::ranges::upper_bound(times, until) - times.begin();
  return {static_cast<std::size_t>(begin), static_cast<std::size_t>(std::max(begin, end))};
}

std::vector<Leg> legsOf(const Stream& machine, const std::array<std::pair<double, double>, 2>& between) {
  const Eigen::Vector3d steps = stepsOf(machine);
  if (steps.maxCoeff() <= 0.0) return {};
  const Stream clean = withoutSpikes(machine, 0.0).stream;
  std::vector<Leg> legs;
  for (const auto& [from, until] : between) {
    const Run run = runBetween(clean.times, from, until);
    if (run.size() < kLeastOfRun) return {};
    const Line line = fitLine(clean.timesOf(run), clean.valuesOf(run));
    legs.push_back({runBetween(machine.times, from, until), line, QuantisationError{clean.timesOf(run), line, steps}});
  }
  return legs;
}

// Variance that rounding errors shared by the samples add to a weighted sum of them. gains: the weights.
double commonOf(const Leg& leg, const std::vector<double>& times, const Eigen::Vector3d& direction, double noise,
                const Eigen::VectorXd& gains) {
  double of_mean = 0.0;
  double of_slope = 0.0;
  for (std::size_t k = leg.run.begin; k < leg.run.end; ++k) {
    const double gain = gains[static_cast<Index>(k)];
    of_mean += gain;
    of_slope += gain * (times[k] - leg.line.t_mean);
  }
  double variance = 0.0;
  for (Index axis = 0; axis < 3; ++axis) {
    const auto share = leg.rounding.shareOf(axis, noise);
    variance +=
        direction[axis] * direction[axis] *
        (of_mean * of_mean * share.mean + 2.0 * of_mean * of_slope * share.both + of_slope * of_slope * share.slope);
  }
  return variance;
}

}  // namespace

std::optional<RoundedMotion> roundedLegs(const Stream& machine, const Eigen::Vector3d& direction,
                                         const std::array<std::pair<double, double>, 2>& legs) {
  const std::vector<Leg> found = legsOf(machine, legs);
  if (found.empty()) return std::nullopt;
  const std::array<Line, 2> lines{found[0].line, found[1].line};
  const std::array<QuantisationError, 2> roundings{found[0].rounding, found[1].rounding};
  const double noise = noiseBeforeRounding(lines, roundings);
  const double coarsest = roundings[0].coarsest();
  if (coarsest * coarsest < 12.0 * kLeastShare * noise * noise) return std::nullopt;
  RoundedMotion rounded;
  for (Index axis = 0; axis < 3; ++axis) {
    const double share = direction[axis] * direction[axis];
    rounded.own += share * roundings[0].ownVariance(axis, noise);
    rounded.common += share * roundings[0].commonVariance(axis, noise);
  }
  rounded.of_sum = [found, direction, noise, times = machine.times](const Eigen::VectorXd& gains) {
    return commonOf(found[0], times, direction, noise, gains) + commonOf(found[1], times, direction, noise, gains);
  };
  return rounded;
}

}  // namespace probebox::metrology
