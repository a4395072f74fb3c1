#include <algorithm>
#include <cmath>
#include <string>

#include "firmware/metrology/checks.hpp"
#include "firmware/metrology/touch_fit.hpp"

namespace probebox::metrology {
namespace {

// Below this the variance of a pool is too uncertain to weigh with.
constexpr double kLeastDof = 20.0;
// Deviation that noise is never taken to be below, mm and raw: digits of a case file.
constexpr double kFloor = 1e-7;

struct Scatter {
  double along{};
  double across{};
  double dof{};  // along; twice as many across

  Scatter& operator+=(const Scatter& other) {
    along += other.along;
    across += other.across;
    dof += other.dof;
    return *this;
  }
  SampleNoise variance() const { return {along / dof + kFloor * kFloor, across / (2.0 * dof) + kFloor * kFloor}; }
};

Scatter scatterOf(const Line& line) {
  const double along = line.scatterAlong(line.slope.normalized());
  return {along, line.scatter.trace() - along, static_cast<double>(line.n) - 2.0};
}

bool sameSpeed(const Retract& a, const Retract& b) {
  return std::abs(a.plan.speed_mm_s - b.plan.speed_mm_s) < 0.02 * std::max(a.plan.speed_mm_s, b.plan.speed_mm_s);
}

SampleNoise pooled(std::span<const Retract> retracts, const Retract& touch, Line Retract::*line) {
  Scatter at_speed;
  Scatter of_all;
  for (const auto& other : retracts) {
    const Scatter scatter = scatterOf(other.*line);
    of_all += scatter;
    if (sameSpeed(touch, other)) at_speed += scatter;
  }
  SampleNoise noise = (at_speed.dof >= kLeastDof ? at_speed : of_all).variance();
  noise.across = of_all.variance().across;
  return noise;
}

// Median over the touches of that speed, so that a bad touch does not hide in a pool which it has spoilt.
double usualVariance(std::span<const Retract> retracts, const Retract& touch, Line Retract::*line) {
  std::vector<double> at_speed;
  std::vector<double> of_all;
  for (const auto& other : retracts) {
    const double variance = scatterOf(other.*line).variance().along;
    of_all.push_back(variance);
    if (sameSpeed(touch, other)) at_speed.push_back(variance);
  }
  auto& variances = at_speed.size() >= 4 ? at_speed : of_all;
  const auto middle = variances.begin() + static_cast<std::ptrdiff_t>(variances.size() / 2);
  std::nth_element(variances.begin(), middle, variances.end());
  return *middle;
}

}  // namespace

PooledNoise poolNoise(std::span<const Retract> retracts) {
  PooledNoise noise;
  for (const auto& touch : retracts) {
    noise.of_touch.push_back({pooled(retracts, touch, &Retract::machine), pooled(retracts, touch, &Retract::probe)});
    noise.dof += touch.machine.n - 2 + touch.probe.n - 2;
  }
  return noise;
}

std::vector<Dropped> noisyTouches(std::span<const Retract> retracts) {
  std::vector<Dropped> noisy;
  for (const auto& touch : retracts) {
    for (const auto& [line, stream] : {std::pair{&Retract::machine, "machine"}, std::pair{&Retract::probe, "probe"}}) {
      const double own = scatterOf(touch.*line).variance().along;
      if (own <= 9.0 * usualVariance(retracts, touch, line)) continue;
      noisy.push_back({touch.plan.name, std::string{"residual-too-large: the "} + stream +
                                            " samples lie more than 3 sigma about their line (slip or bounce)"});
      break;
    }
  }
  return noisy;
}

}  // namespace probebox::metrology
