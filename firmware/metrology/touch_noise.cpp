#include "firmware/metrology/touch_noise.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "firmware/metrology/checks.hpp"
#include "firmware/metrology/signal.hpp"

namespace probebox::metrology {
namespace {

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

// variance = still + jitter * speed^2: a jitter of the stamps shows as noise along the motion, in proportion to the
// speed.
struct NoiseLaw {
  double still{};
  double jitter{};  // s^2
  double across{};
  double dof{};

  SampleNoise at(double speed) const { return {still + jitter * speed * speed, across}; }
};

// Rate of change of the stream, mm/s or raw/s.
double rateOf(const Line& line) {
  return line.slope.norm();
}

// Line through the squared residuals of the touches against the square of their rates, weighted by what a sum of
// squares is uncertain by. The jitter counts only where it stands out by three deviations.
NoiseLaw noiseLaw(std::span<const Retract> retracts, Line Retract::*member) {
  Scatter all;
  for (const auto& touch : retracts) all += scatterOf(touch.*member);
  NoiseLaw law{.still = all.variance().along, .jitter = 0.0, .across = all.variance().across, .dof = all.dof};
  NoiseLaw tried = law;
  for (int round = 0; round < 5; ++round) {
    Eigen::Matrix2d normal = Eigen::Matrix2d::Zero();
    Eigen::Vector2d right = Eigen::Vector2d::Zero();
    for (const auto& touch : retracts) {
      const Scatter own = scatterOf(touch.*member);
      const double rate = rateOf(touch.*member);
      const Eigen::Vector2d row{1.0, rate * rate};
      const double weight = own.dof / (2.0 * std::pow(tried.at(rate).along, 2));
      normal += weight * row * row.transpose();
      right += weight * row * own.along / own.dof;
    }
    const Eigen::Matrix2d covariance = normal.inverse();
    const Eigen::Vector2d solution = covariance * right;
    if (!(solution[1] > 3.0 * std::sqrt(covariance(1, 1)))) return law;
    tried.still = std::max(solution[0], kFloor * kFloor);
    tried.jitter = solution[1];
  }
  return tried;
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
  return median(variances);
}

}  // namespace

PooledNoise poolNoise(std::span<const Retract> retracts) {
  const NoiseLaw machine = noiseLaw(retracts, &Retract::machine);
  const NoiseLaw probe = noiseLaw(retracts, &Retract::probe);
  PooledNoise noise;
  noise.dof = static_cast<std::size_t>(machine.dof + probe.dof);
  for (const auto& touch : retracts) {
    noise.of_touch.push_back({machine.at(rateOf(touch.machine)), probe.at(rateOf(touch.probe))});
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
