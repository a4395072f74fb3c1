#include "firmware/metrology/touch/stamp_jitter.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "firmware/metrology/fit/line.hpp"
#include "firmware/metrology/fit/robust_statistics.hpp"
#include "protocol/units/tolerances.hpp"

namespace probebox::metrology {
namespace {

constexpr double kMost_s = 3e-4;
constexpr double kMedianSquare = 0.4549;  // of a normal variate
// Shares of the deflection, and of the way back, between which a stream surely moves at constant speed.
constexpr double kDeflected = 0.7;
constexpr double kReleased = 0.1;
constexpr double kUnderWay = 0.3;

// Distance of one sample of a moving stream from the line between its neighbours.
struct Miss {
  double square{};  // for unit weight of its own noise
  double still{};   // variance of a sample at rest
  double rate{};    // of the stream, per second
};

struct Moving {
  std::vector<double> values;
  Run run;
};

void addMisses(std::vector<Miss>& misses, const Stream& stream, const Eigen::Vector3d& direction,
               const Moving& moving) {
  const auto [begin, end] = moving.run;
  if (end < begin + 3) return;
  const auto& t = stream.times;
  const auto& x = moving.values;
  const double still = std::max(noiseOf(stream, direction), kCaseDigits);
  const double rate = (x[end - 1] - x[begin]) / (t[end - 1] - t[begin]);
  for (std::size_t k = begin + 1; k + 1 < end; k += strideOf(end - begin)) {
    const double weight = (t[k] - t[k - 1]) / (t[k + 1] - t[k - 1]);
    const double missed = x[k] - x[k - 1] - weight * (x[k + 1] - x[k - 1]);
    misses.push_back(
        {missed * missed / (1.0 + weight * weight + (1.0 - weight) * (1.0 - weight)), still * still, rate});
  }
}

// The machine on its way back, well after it has gathered speed.
Moving retreating(const Touch& touch) {
  Moving moving{touch.machine.along(touch.plan.retract, {0, touch.machine.times.size()}), {}};
  const auto apex = std::ranges::min_element(moving.values);
  const double reach = *std::max_element(apex, moving.values.end()) - *apex;
  moving.run.begin = static_cast<std::size_t>(apex - moving.values.begin());
  while (moving.values[moving.run.begin] < *apex + kUnderWay * reach) ++moving.run.begin;
  moving.run.end = moving.values.size();
  return moving;
}

// The deflection on its last way down.
Moving releasing(const Stream& probe, const Eigen::Vector3d& direction) {
  Moving moving{probe.along(direction, {0, probe.times.size()}), {}};
  const double most = *std::ranges::max_element(moving.values);
  moving.run.begin = moving.values.size();
  while (moving.run.begin > 0 && moving.values[moving.run.begin - 1] < kDeflected * most) --moving.run.begin;
  moving.run.end = moving.run.begin;
  while (moving.run.end < moving.values.size() && moving.values[moving.run.end] > kReleased * most) ++moving.run.end;
  return moving;
}

double medianRatio(const std::vector<Miss>& misses, double jitter_s) {
  std::vector<double> ratios;
  ratios.reserve(misses.size());
  for (const auto& miss : misses) {
    const double moved = jitter_s * miss.rate;
    ratios.push_back(miss.square / (miss.still + moved * moved));
  }
  return median(ratios);
}

// The jitter with which half of the misses are as small as half of a normal variate's are.
double jitterOf(const std::vector<Miss>& misses) {
  if (misses.empty() || medianRatio(misses, 0.0) <= kMedianSquare) return 0.0;
  double low = 0.0;
  double high = kMost_s;
  for (int halving = 0; halving < 12; ++halving) {
    const double middle = (low + high) / 2.0;
    (medianRatio(misses, middle) > kMedianSquare ? low : high) = middle;
  }
  return high;
}

}  // namespace

Eigen::Vector3d stepsOf(const Stream& stream) {
  if (stream.steps) return *stream.steps;
  Eigen::Vector3d steps;
  for (Eigen::Index k = 0; k < 3; ++k) {
    const Eigen::VectorXd channel = stream.values.col(k);
    steps[k] = resolutionOf(std::span{channel.data(), stream.times.size()});
  }
  return steps;
}

double noiseOf(const Stream& stream, const Eigen::Vector3d& direction) {
  const double local = localDeviation(stream.times, stream.along(direction, {0, stream.times.size()}), Trim::heavy);
  return std::max(local, 0.5 * stepsOf(stream).maxCoeff());
}

StampJitter stampJitter(std::span<const Touch> touches) {
  std::vector<Miss> of_machine;
  std::vector<Miss> of_probe;
  for (const auto& touch : touches) {
    addMisses(of_machine, touch.machine, touch.plan.retract, retreating(touch));
    Eigen::Index deepest = 0;
    touch.probe.values.rowwise().squaredNorm().maxCoeff(&deepest);
    const Eigen::Vector3d direction = touch.probe.values.row(deepest).transpose().stableNormalized();
    addMisses(of_probe, touch.probe, direction, releasing(touch.probe, direction));
  }
  return {jitterOf(of_machine), jitterOf(of_probe)};
}

}  // namespace probebox::metrology
