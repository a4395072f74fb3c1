#include "firmware/clock/tracked_phase.hpp"

#include <algorithm>
#include <cmath>

namespace probebox::clock {
namespace {

constexpr std::int64_t kSettleAtLeast = 32;  // stamps
constexpr double kSettledPpm = 20;           // sigma of the frequency
constexpr double kJudgedPpm = 1;             // the same where the frequency is close to the limit

Nanoseconds wholePeriod(double period_ns) {
  return Nanoseconds{std::llround(period_ns)};
}

}  // namespace

TrackedPhase::TrackedPhase(const Config& config)
    : config_{config},
      rounding_ns_{config.period_ns - static_cast<double>(wholePeriod(config.period_ns).count())},
      filter_{wholePeriod(config.period_ns)},
      jitter_{static_cast<double>(config.jitter.count()), config.learns},
      wander_{wholePeriod(config.period_ns), config.phase_wander_ns_per_sqrt_s,
              config.frequency_wander_ppb_per_sqrt_s} {
  filter_.setWalk(wander_.walk());
}

void TrackedPhase::forgetJitter() {
  jitter_ = Jitter{static_cast<double>(config_.jitter.count()), config_.learns};
}

void TrackedPhase::start(Tick tick, MonoTime at, double phase_sigma_ns, double drift_ns, double drift_sigma_ns) {
  filter_.start(tick, at, phase_sigma_ns, drift_ns, drift_sigma_ns);
  settled_ = 0;
  wander_.restart();
}

Jitter::Judgement TrackedPhase::take(const Stamp& stamp) {
  filter_.predict(stamp.ahead);
  if (stamp.after_holdover) {
    filter_.loosen(ppmToNs(config_.holdover_ppm), stamp.ahead);
    wander_.restart();
  }
  const double phase_variance = filter_.phaseVariance();
  const Jitter::Judgement judged = jitter_.judge(stamp.residual_ns, phase_variance);
  const bool was_learned = jitter_.learned();
  jitter_.track(stamp.residual_ns, phase_variance, judged, stamp.since_last);
  if (jitter_.learned() != was_learned) wander_.restart();
  if (stamp.walks) {
    const bool has_learned =
        wander_.push(filter_.tick(), filter_.at(), filter_.subNanosecond() + judged.innovation_ns, judged.variance_ns2);
    if (has_learned && config_.learns) filter_.setWalk(wander_.walk());
  }
  filter_.update(judged.innovation_ns, judged.variance_ns2);
  return judged;
}

TrackedPhase::Frequency TrackedPhase::settle() {
  ++settled_;
  const double sigma_ppm = std::sqrt(filter_.driftVariance()) / ppmToNs(1);
  if (settled_ < kSettleAtLeast || sigma_ppm > kSettledPpm) return Frequency::uncertain;
  const double over_ppm = std::abs(offsetPpm()) - config_.max_ppm;
  const bool is_close = std::abs(over_ppm) < 3 * sigma_ppm && sigma_ppm > kJudgedPpm;
  if (is_close) return Frequency::uncertain;
  return over_ppm > 0 ? Frequency::refused : Frequency::within_limit;
}

bool TrackedPhase::beyondLimit() const {
  return std::abs(driftNs()) > ppmToNs(config_.max_ppm);
}

double TrackedPhase::sigmaNs(std::int64_t ahead, bool in_holdover) const {
  const double in_model = std::sqrt(std::max(0.0, filter_.phaseVariance(ahead)));
  if (!in_holdover) return in_model;
  return std::hypot(in_model, ppmToNs(config_.holdover_ppm) * static_cast<double>(ahead));
}

double TrackedPhase::holdoverDriftSigmaNs() const {
  return std::hypot(std::sqrt(filter_.driftVariance()), ppmToNs(config_.holdover_ppm));
}

}  // namespace probebox::clock
