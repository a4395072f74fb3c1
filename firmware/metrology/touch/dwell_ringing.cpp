#include "firmware/metrology/touch/dwell_ringing.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <optional>
#include <span>

#include "firmware/metrology/fit/decompositions.hpp"
#include "firmware/metrology/touch/stamp_jitter.hpp"
#include "protocol/units/angle.hpp"

namespace probebox::metrology {
namespace {

constexpr double kNearRest = 0.85;    // share of the deflection at rest that still counts as near it
constexpr double kSeparating = 0.02;  // and at which the stylus is as good as free
constexpr double kStanding = 1e-5;    // of the overtravel, that a machine at rest may seem to move
constexpr std::size_t kLeastOfDwell = 6;
constexpr double kLeastTurns = 1.5;  // of the oscillation within a rest: slower ones look like a drift
constexpr double kSignificant = 5.0;
// Bounds on the work: a stylus has long come to rest by then, and a few touches determine the frequency for all.
constexpr std::size_t kMostSamples = 2000;  // of one rest
constexpr double kMostTurns = 100.0;
constexpr std::size_t kSearched = 4'000;  // samples of all rests that the coarse search looks at

// Resting samples of one touch.
struct Rest {
  std::size_t touch{};
  Run run;
  std::size_t until{};    // sample at which the probe separates
  double noise_square{};  // variance of one sample, sum of the channels
};

// Frequency and decay, per rest of `length_s`.
struct Tone {
  double turns{};
  double decay{};
};

// Stamps between which a signal is near its rest, about a sample that is.
struct Plateau {
  std::size_t first{};
  std::size_t last{};
};

template <typename IsNear>
Plateau plateauAbout(std::size_t at, std::size_t size, const IsNear& near) {
  Plateau found{at, at};
  while (found.first > 0 && near(found.first - 1)) --found.first;
  while (found.last + 1 < size && near(found.last + 1)) ++found.last;
  return found;
}

// Deflection along its direction at rest, as a share of it.
std::vector<double> shares(const Stream& probe) {
  const Eigen::VectorXd size = probe.values.rowwise().norm();
  std::vector<double> large;
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (Eigen::Index k = 0; k < size.size(); ++k) {
    if (size[k] < kNearRest * size.maxCoeff()) continue;
    large.push_back(size[k]);
    sum += probe.values.row(k).transpose();
  }
  // High among them: of a slow drive few rest. Too high a level only shortens the rest.
  const auto level = large.begin() + static_cast<std::ptrdiff_t>(19 * large.size() / 20);
  std::ranges::nth_element(large, level);
  std::vector<double> share = probe.along(sum.normalized(), {0, probe.times.size()});
  for (double& value : share) value /= *level;
  return share;
}

// How long the machine takes from near its rest to rest, and back, s.
struct Ramps {
  double in_s{};
  double out_s{};
};

Ramps rampsOf(const Touch& touch, double overtravel_mm) {
  const std::vector<double> travel = touch.machine.along(touch.plan.retract, {0, touch.machine.times.size()});
  const auto apex = static_cast<std::size_t>(std::ranges::min_element(travel) - travel.begin());
  const double noise = 6.0 * localDeviation(touch.machine.times, travel, Trim::heavy);
  const auto within = [&](double limit) {
    return plateauAbout(apex, travel.size(), [&](std::size_t k) { return travel[k] - travel[apex] < limit; });
  };
  const double near_mm = (1.0 - kNearRest) * overtravel_mm;
  const double still_mm = std::min(std::max(kStanding * overtravel_mm, noise), 0.5 * near_mm);
  const Plateau near = within(near_mm);
  const Plateau still = within(still_mm);
  const auto& times = touch.machine.times;
  const double period = touch.machine.period();
  // At constant acceleration so much of the ramp hides in the noise.
  const double hidden = 1.0 / (1.0 - std::sqrt(still_mm / near_mm));
  return {hidden * (times[still.first] - times[near.first]) + period,
          hidden * (times[near.last] - times[still.last]) + period};
}

std::optional<Rest> restOf(const Touch& touch, std::size_t index) {
  const auto& times = touch.probe.times;
  if (times.size() < kLeastOfDwell || touch.machine.times.size() < kLeastOfDwell) return std::nullopt;
  const std::vector<double> share = shares(touch.probe);
  std::size_t last = share.size();
  while (last > 0 && !(share[last - 1] >= kNearRest)) --last;
  if (last == 0) return std::nullopt;
  const auto near = [&](std::size_t k) { return share[k] >= kNearRest; };
  const Plateau plateau = plateauAbout(last - 1, share.size(), near);
  std::size_t until = plateau.last;
  while (until + 1 < share.size() && share[until] > kSeparating) ++until;
  const double falling_s = (times[until] - times[plateau.last]) / (kNearRest - kSeparating);
  const Ramps ramps = rampsOf(touch, touch.plan.speed_mm_s * falling_s);
  const double from = times[plateau.first] + ramps.in_s;
  const double to = times[plateau.last] - ramps.out_s;
  const auto begin = static_cast<std::size_t>(std::ranges::lower_bound(times, from) - times.begin());
  const auto end = static_cast<std::size_t>(std::ranges::upper_bound(times, to) - times.begin());
  if (end < begin + kLeastOfDwell) return std::nullopt;
  Rest rest{index, {begin, std::min(end, begin + kMostSamples)}, until, 0.0};
  for (Eigen::Index channel = 0; channel < 3; ++channel) {
    const Eigen::VectorXd values = touch.probe.values.col(channel);
    const std::span view{values.data(), times.size()};
    // A reading at rest changes between two steps of its converter.
    const double sigma = std::max(localDeviation(times, view, Trim::heavy), 0.5 * resolutionOf(view));
    rest.noise_square += sigma * sigma;
  }
  return rest;
}

// The constant and the two phases at these stamps.
Eigen::MatrixX3d shapes(std::span<const double> times, double from, double length_s, const Tone& tone) {
  Eigen::MatrixX3d shape{static_cast<Eigen::Index>(times.size()), 3};
  for (std::size_t k = 0; k < times.size(); ++k) {
    const double share = (times[k] - from) / length_s;
    const double turn = kTurn * tone.turns * share;
    const double left = std::exp(-tone.decay * share);
    shape.row(static_cast<Eigen::Index>(k)) << 1.0, left * std::cos(turn), left * std::sin(turn);
  }
  return shape;
}

class Rests {
 public:
  explicit Rests(const std::vector<Touch>& touches) : touches_{touches} {
    for (std::size_t i = 0; i < touches.size(); ++i) {
      if (const auto rest = restOf(touches[i], i)) rests_.push_back(*rest);
    }
    for (const auto& rest : rests_) {
      const auto times = timesOf(rest);
      length_s_ = std::max(length_s_, times.back() - times.front());
      period_s_ = std::max(period_s_, probeOf(rest).period());
      const Rows3 values = probeOf(rest).valuesOf(rest.run);
      const Rows3 off = values.rowwise() - values.colwise().mean();
      still_ += off.squaredNorm() / noiseOf(rest);
      samples_ += static_cast<double>(rest.run.size());
    }
  }

  // Nothing where the rests hold no more than noise, or no oscillation explains them.
  std::optional<Tone> tone() const {
    const auto touches = static_cast<double>(rests_.size());
    const auto stands_out = [](double squares, double dof) {
      return squares > dof + kSignificant * std::sqrt(2.0 * dof);
    };
    if (rests_.empty() || !stands_out(still_, 3.0 * (samples_ - touches))) return std::nullopt;
    const Tone best = refined(coarse());
    // Reduction of the residuals against the number of unknowns spent on it.
    return stands_out(still_ - left(best), 6.0 * touches + 2.0) ? std::optional{best} : std::nullopt;
  }

  void takeOut(const Tone& tone, std::vector<Touch>& touches) const {
    for (const auto& rest : rests_) {
      const auto times = timesOf(rest);
      const Eigen::Matrix3d amplitudes =
          solveLeastSquares(shapes(times, times.front(), length_s_, tone), probeOf(rest).valuesOf(rest.run));
      Stream& probe = touches[rest.touch].probe;
      const Run run{rest.run.begin, rest.until + 1};
      const Eigen::MatrixX3d shape = shapes(probe.timesOf(run), times.front(), length_s_, tone);
      probe.values.middleRows(static_cast<Eigen::Index>(run.begin), static_cast<Eigen::Index>(run.size())) -=
          shape.rightCols<2>() * amplitudes.bottomRows<2>();
    }
  }

 private:
  const Stream& probeOf(const Rest& rest) const { return touches_[rest.touch].probe; }
  std::span<const double> timesOf(const Rest& rest) const { return probeOf(rest).timesOf(rest.run); }
  // Variance of one channel; not below the digits of a case file.
  static double noiseOf(const Rest& rest) { return std::max(rest.noise_square / 3.0, 1e-18); }

  // Weighted squares that are left of these rests.
  double left(const Tone& tone, std::span<const Rest> rests) const {
    double squares = 0.0;
    for (const auto& rest : rests) {
      const auto times = timesOf(rest);
      const Eigen::MatrixXd values = probeOf(rest).valuesOf(rest.run);
      const Eigen::MatrixX3d shape = shapes(times, times.front(), length_s_, tone);
      squares += (values - shape * solveLeastSquares(shape, values)).squaredNorm() / noiseOf(rest);
    }
    return squares;
  }

  double left(const Tone& tone) const { return left(tone, rests_); }

  std::span<const Rest> searched() const {
    std::size_t count = 0, samples = 0;
    while (count < rests_.size() && samples < kSearched) samples += rests_[count++].run.size();
    return std::span{rests_}.first(count);
  }

  Tone coarse() const {
    Tone best;
    double least = std::numeric_limits<double>::infinity();
    const double highest = std::min(0.5 * length_s_ / period_s_, kMostTurns);
    const auto some = searched();
    for (double turns = kLeastTurns; turns <= highest; turns += 0.25) {
      for (const double decay : {0.5, 2.0, 5.0}) {
        const double squares = left({turns, decay}, some);
        if (squares < least) least = squares, best = {turns, decay};
      }
    }
    return best;
  }

  // Steps that halve whenever none of them leads on.
  Tone refined(Tone best) const {
    double least = left(best);
    double step = 0.125;
    for (int round = 0; round < 60 && step > 1e-4; ++round) {
      bool better = false;
      for (const auto& [turns, decay] : {std::array{step, 0.0}, {-step, 0.0}, {0.0, 4.0 * step}, {0.0, -4.0 * step}}) {
        const Tone next{best.turns + turns, std::max(0.0, best.decay + decay)};
        const double squares = next.turns < kLeastTurns ? least : left(next);
        if (squares < least) least = squares, best = next, better = true;
      }
      if (!better) step /= 2.0;
    }
    return best;
  }

  const std::vector<Touch>& touches_;
  std::vector<Rest> rests_;
  double length_s_{};
  double period_s_{};
  double still_{};
  double samples_{};
};

}  // namespace

std::vector<Touch> withoutRinging(std::vector<Touch> touches) {
  const std::vector<Touch> recorded = touches;
  const Rests rests{recorded};
  const auto tone = rests.tone();
  if (!tone) return touches;
  for (auto& touch : touches) touch.probe.steps = stepsOf(touch.probe);
  rests.takeOut(*tone, touches);
  return touches;
}

}  // namespace probebox::metrology
