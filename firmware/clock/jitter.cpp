#include "firmware/clock/jitter.hpp"

#include <algorithm>
#include <cmath>

#include "firmware/clock/statistics.hpp"

namespace probebox::clock {
namespace {

constexpr double kClip = 1.5;                // Huber's k, in spreads
constexpr double kOutlier = 4;               // spreads
constexpr double kFurthest = 6;              // what one residual may say, in effective sigmas
constexpr double kWellKnown = 0.25;          // phase variance against the jitter's
constexpr double kGaussianSlope = 0.8664;    // P(|r| < 1.5)
constexpr double kGaussianSquares = 0.7785;  // E[clip(r, 1.5)^2]
constexpr std::uint64_t kYoung = 8092;
constexpr double kSlowest = 1.0 / 8192;  // of the tracking averages
constexpr double kStray = -6;  // log of the density of stray edges against the peak: 1 % of edges over 0.6 period

}  // namespace

Jitter::Jitter(double spread_ns, bool learns) : spread_ns_{spread_ns}, learns_{learns} {
  start(spread_ns);
}

void Jitter::start(double spread_ns) {
  spread_ns_ = std::max(spread_ns, 1.0);
  setInformation({kGaussianSquares * spread_ns_ * spread_ns_, kGaussianSlope});
}

Score::Value Jitter::score(double residual_ns, double limit_ns) const {
  if (learned_) {
    const Score::Value in_units = score_(residual_ns / unit_ns_);
    return {in_units.psi * unit_ns_, in_units.slope};
  }
  return {std::clamp(residual_ns, -limit_ns, limit_ns), std::abs(residual_ns) < limit_ns ? 1.0 : 0.0};
}

double Jitter::clipNs() const {
  return kClip * spread_ns_;
}

double Jitter::logLikelihood(double residual_ns) const {
  const double spreads = std::abs(residual_ns) / spread_ns_;
  const double clipped = spreads < kClip ? -0.5 * spreads * spreads : kClip * (0.5 * kClip - spreads);
  return std::max(kStray, learned_ ? score_.logDensity(residual_ns / unit_ns_) : clipped);
}

Jitter::Judgement Jitter::judge(double residual_ns, double phase_variance_ns2) const {
  const double total = spread_ns_ * spread_ns_ + phase_variance_ns2;
  const bool outlier = residual_ns * residual_ns > kOutlier * kOutlier * total;
  const Score::Value value = score(residual_ns, clipNs());
  double innovation = value.psi / information_.slope;
  if (phase_variance_ns2 > kWellKnown * variance_ns2_) {
    // A score is a local statement; a phase that is hardly known needs the whole residual, within reason.
    const double limit = 2 * kClip * std::sqrt(total);
    innovation = std::clamp(residual_ns, -limit, limit);
  } else if (innovation * innovation > kFurthest * kFurthest * variance_ns2_) {
    innovation = std::copysign(kFurthest * std::sqrt(variance_ns2_), innovation);
  }
  return {innovation, variance_ns2_, outlier, value};
}

void Jitter::setInformation(const Information& information) {
  information_ = information;
  variance_ns2_ = information.psi_squared / (information.slope * information.slope);
}

void Jitter::track(double residual_ns, double phase_variance_ns2, const Judgement& judged, Nanoseconds since_last) {
  if (phase_variance_ns2 > kWellKnown * variance_ns2_) return;
  ++tracked_;
  tracked_for_ += since_last;
  const Score::Value value = judged.score;
  const bool is_young = tracked_ < kYoung;
  const double weight = is_young ? 1 / static_cast<double>(tracked_ + 100) : kSlowest;
  setInformation({information_.psi_squared + weight * (value.psi * value.psi - information_.psi_squared),
                  std::max(0.2, information_.slope + weight * (value.slope - information_.slope))});
  // The median as the point that half of the absolute residuals exceed.
  const double step = spread_ns_ * (is_young ? std::clamp(4 / static_cast<double>(tracked_ + 20), 0.002, 0.1) : 0.002);
  spread_ns_ = std::max(1.0, spread_ns_ + (kMadToSigma * std::abs(residual_ns) > spread_ns_ ? step : -step));
  if (learns_ && !learned_) learn(residual_ns);
}

void Jitter::learn(double residual_ns) {
  const double seconds = toSeconds(tracked_for_);
  const bool spread_is_settled = tracked_ > 500 && seconds > 0.1 * kLearnForSeconds;
  if (!spread_is_settled) return;
  if (unit_ns_ == 0) unit_ns_ = spread_ns_;
  score_.collect(residual_ns / unit_ns_);
  if (seconds < kLearnForSeconds || score_.collected() < kLearnAtLeast) return;
  const double information = score_.solve();
  learned_ = true;
  setInformation({information * unit_ns_ * unit_ns_, information});
}

}  // namespace probebox::clock
