#include "firmware/metrology/touch/stamp_jumps.hpp"

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "firmware/metrology/dataset/configuration.hpp"
#include "firmware/metrology/fit/robust_statistics.hpp"
#include "firmware/metrology/touch/stamp_jitter.hpp"
#include "protocol/units/tolerances.hpp"

namespace probebox::metrology {
namespace {

constexpr double kUnusualInterval = 0.5;  // of the usual interval, more or less
constexpr double kJumpDeviations = 5.0;
constexpr std::size_t kMostOfSide = 5, kLeastOfSide = 3;  // samples
constexpr double kMovingShare = 0.1;                      // of the nominal speed
constexpr double kSteadyShare = 0.05;                     // change of the speed over the interval
constexpr double kLeastJump = 0.25;                       // of the usual interval

struct Even {
  Line line;
  double noise_mm{};  // of one sample
};

// The machine's motion along the retract on one side of an interval, where it is even.
std::optional<Even> evenSide(const Touch& touch, std::size_t at, bool before, double still_mm, double jitter_s) {
  const std::size_t offered = std::min(kMostOfSide, before ? at : touch.machine.times.size() - at);
  for (std::size_t count = offered; count >= kLeastOfSide; --count) {
    const Run run = before ? Run{at - count, at} : Run{at, at + count};
    const Line line = fitLine(touch.machine.timesOf(run), touch.machine.valuesOf(run));
    const double speed = std::abs(line.slope.dot(touch.plan.retract));
    const double noise = std::max(std::hypot(still_mm, jitter_s * speed), kCaseDigits);
    const double rms = std::sqrt(line.scatterAlong(touch.plan.retract) / static_cast<double>(count - 2));
    if (speed > kMovingShare * touch.plan.speed_mm_s && rms <= 3.0 * noise) return Even{line, noise};
  }
  return std::nullopt;
}

// What the stamps go on by beyond what the machine moves, s; 0 where that does not stand out.
double jumpBetween(const Even& before, const Even& after, const Eigen::Vector3d& along, double interval, double usual) {
  const double from = before.line.slope.dot(along);
  const double to = after.line.slope.dot(along);
  const double speed = 0.5 * (from + to);
  if (from * to <= 0.0 || std::abs(from - to) > kSteadyShare * std::abs(speed)) return 0.0;
  const double apart = after.line.t_mean - before.line.t_mean;
  const double jump = apart - (after.line.mean - before.line.mean).dot(along) / speed;
  const auto variance = [&](const Even& side) {
    const double of_mean = 1.0 / static_cast<double>(side.line.n);
    return side.noise_mm * side.noise_mm * (of_mean + 0.25 * apart * apart / side.line.sxx);
  };
  const double sd = std::sqrt(variance(before) + variance(after)) / std::abs(speed);
  // A feed that is allowed to change a little goes on so in an interval without samples.
  return std::abs(jump) > kJumpDeviations * sd + kLeastJump * usual + kSteadyShare * interval ? jump : 0.0;
}

}  // namespace

std::optional<Refusal> stampsJump(const Touch& touch, double jitter_s) {
  const auto& times = touch.machine.times;
  std::vector<double> apart;
  for (std::size_t k = 1; k < times.size(); ++k) apart.push_back(times[k] - times[k - 1]);
  if (apart.size() < 2 * kLeastOfSide) return std::nullopt;
  std::vector<double> sorted = apart;
  const double usual = median(sorted);
  const double still_mm = noiseOf(touch.machine, touch.plan.retract);
  for (std::size_t k = 1; k < times.size(); ++k) {
    if (std::abs(apart[k - 1] - usual) <= kUnusualInterval * usual) continue;
    const auto before = evenSide(touch, k, true, still_mm, jitter_s);
    const auto after = evenSide(touch, k, false, still_mm, jitter_s);
    if (!before || !after) continue;
    const double jump = jumpBetween(*before, *after, touch.plan.retract, apart[k - 1], usual);
    if (jump == 0.0) continue;
    return Refusal{"stamps-jump", touch.plan.name + ": the machine's stamps jump by " + text(jump) + " s at " +
                                      text(times[k]) +
                                      " s, as its way tells; check the clock of the record and measure again"};
  }
  return std::nullopt;
}

}  // namespace probebox::metrology
