#pragma once
#include <cstdint>

#include "protocol/units/time.hpp"

namespace probebox::clock {

// Two-state Kalman filter: time of the tick (phase, ns) and deviation of its period from nominal (frequency, ns/tick).
// Both are random walks, given per tick. The time is an integer plus a residual below 1 ns, so precision does not
// degrade over days.
class PhaseFilter {
 public:
  struct Walk {
    double phase_ns2{};      // variance of the phase's step per tick
    double frequency_ns2{};  // variance of the frequency step per tick, (ns/tick)^2
  };

  explicit PhaseFilter(Nanoseconds nominal_period) : nominal_ns_{nominal_period.count()} {}

  void start(Tick tick, MonoTime at, double phase_sigma_ns, double drift_ns, double drift_sigma_ns);
  void renumber(Tick tick) { tick_ = tick; }
  void setWalk(Walk walk) { walk_ = walk; }

  // Advances by `ticks`.
  void predict(std::int64_t ticks);
  // Adds uncertainty from outside the model, after predict(): the frequency was off by `drift_sigma_ns` during the last
  // `ticks`.
  void loosen(double drift_sigma_ns, std::int64_t ticks);
  // innovation: measured minus predicted phase, ns; variance: of the measurement, ns^2.
  void update(double innovation_ns, double variance_ns2);

  // Number of ticks from the filter's tick to the one nearest to `at`. residual(): how much later `at` is than that
  // tick, ns.
  std::int64_t nearest(MonoTime at) const;
  double residual(MonoTime at, std::int64_t ticks_ahead) const {
    const std::int64_t beyond_nominal = toNs(at) - anchor_ns_ - ticks_ahead * nominal_ns_;
    return static_cast<double>(beyond_nominal) - phase_ns_ - static_cast<double>(ticks_ahead) * drift_ns_;
  }

  // How much later this filter's tick is than the same tick on the line of another one, ns.
  double aheadOf(const PhaseFilter& other) const { return other.residual(at(), tick_ - other.tick_) + phase_ns_; }

  Tick tick() const { return tick_; }
  MonoTime at() const { return monoTime(anchor_ns_); }
  double subNanosecond() const { return phase_ns_; }
  double drift() const { return drift_ns_; }  // ns per tick, beyond nominal
  MonoTime timeOf(std::int64_t ticks_ahead) const;
  std::int64_t periodQ32() const;

  double phaseVariance() const { return phase_variance_; }
  double phaseVariance(std::int64_t ticks_ahead) const {
    const auto n = static_cast<double>(ticks_ahead);
    const double walked = walk_.phase_ns2 + walk_.frequency_ns2 * n * n / 3;
    return phase_variance_ + n * (2 * covariance_ + n * drift_variance_ + walked);
  }
  double driftVariance() const { return drift_variance_; }

 private:
  void carry();

  std::int64_t nominal_ns_;
  Tick tick_{};
  std::int64_t anchor_ns_{};
  double phase_ns_{};  // beyond the anchor, |phase| <= 1
  double drift_ns_{};
  double phase_variance_{};
  double covariance_{};
  double drift_variance_{};
  Walk walk_;
};

}  // namespace probebox::clock
