#include "firmware/clock/phase_filter.hpp"

#include "protocol/units/rounding.hpp"

namespace probebox::clock {

void PhaseFilter::start(Tick tick, MonoTime at, double phase_sigma_ns, double drift_ns, double drift_sigma_ns) {
  tick_ = tick;
  anchor_ns_ = toNs(at);
  phase_ns_ = 0;
  drift_ns_ = drift_ns;
  phase_variance_ = phase_sigma_ns * phase_sigma_ns;
  covariance_ = 0;
  drift_variance_ = drift_sigma_ns * drift_sigma_ns;
}

void PhaseFilter::predict(std::int64_t ticks) {
  const auto n = static_cast<double>(ticks);
  tick_ = tick_ + ticks;
  anchor_ns_ += ticks * nominal_ns_;
  phase_ns_ += n * drift_ns_;
  carry();
  phase_variance_ = phaseVariance(ticks);
  covariance_ += n * drift_variance_ + walk_.frequency_ns2 * n * n / 2;
  drift_variance_ += walk_.frequency_ns2 * n;
}

void PhaseFilter::loosen(double drift_sigma_ns, std::int64_t ticks) {
  const auto n = static_cast<double>(ticks);
  const double variance = drift_sigma_ns * drift_sigma_ns;
  phase_variance_ += n * n * variance;
  covariance_ += n * variance;
  drift_variance_ += variance;
}

void PhaseFilter::update(double innovation_ns, double variance_ns2) {
  const double weight = 1 / (phase_variance_ + variance_ns2);
  const double phase_gain = phase_variance_ * weight;
  const double drift_gain = covariance_ * weight;
  phase_ns_ += phase_gain * innovation_ns;
  drift_ns_ += drift_gain * innovation_ns;
  drift_variance_ -= drift_gain * covariance_;
  covariance_ -= drift_gain * phase_variance_;
  phase_variance_ -= phase_gain * phase_variance_;
  carry();
}

// Whole nanoseconds go to the integer, so that the residual keeps all its digits.
void PhaseFilter::carry() {
  const auto whole = static_cast<std::int64_t>(phase_ns_);
  anchor_ns_ += whole;
  phase_ns_ -= static_cast<double>(whole);
}

std::int64_t PhaseFilter::nearest(MonoTime at) const {
  const auto elapsed = static_cast<double>(toNs(at) - anchor_ns_) - phase_ns_;
  return toNearest(elapsed / (static_cast<double>(nominal_ns_) + drift_ns_));
}

MonoTime PhaseFilter::timeOf(std::int64_t ticks_ahead) const {
  const double beyond_nominal = phase_ns_ + static_cast<double>(ticks_ahead) * drift_ns_;
  return monoTime(anchor_ns_ + ticks_ahead * nominal_ns_ + toNearest(beyond_nominal));
}

std::int64_t PhaseFilter::periodQ32() const {
  constexpr std::int64_t kOne = std::int64_t{1} << 32;
  return nominal_ns_ * kOne + toNearest(drift_ns_ * static_cast<double>(kOne));
}

}  // namespace probebox::clock
