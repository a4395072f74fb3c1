#pragma once
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <functional>
#include <optional>
#include <random>
#include <vector>

#include "protocol/events/event.hpp"

namespace probebox::support {

// Distribution of the kernel's stamps around the true edge. bound_ns2: smallest variance that an estimate from one
// stamp can have, one over the Fisher information about location.
struct StampJitter {
  std::function<double(std::mt19937_64&)> draw_ns;
  double bound_ns2{};

  // sigma: ns.
  static StampJitter gaussian(double sigma_ns);
  // Late by a lognormal delay: median ns, shape s (standard deviation of the logarithm); a share of outliers is later
  // by an exponential of mean 15 medians on top.
  static StampJitter lognormal(double median_ns, double shape, double outlier_share);
};

inline StampJitter StampJitter::gaussian(double sigma_ns) {
  return {[=](auto& random) { return std::normal_distribution{0.0, sigma_ns}(random); }, sigma_ns * sigma_ns};
}

inline StampJitter StampJitter::lognormal(double median_ns, double shape, double outlier_share) {
  const double mu = std::log(median_ns);
  const double information = std::exp(-2 * mu + 2 * shape * shape) * (1 + 1 / (shape * shape));
  // Outliers carry next to no information about the location.
  return {[=](auto& random) {
            double delay = std::lognormal_distribution{mu, shape}(random);
            if (std::bernoulli_distribution{outlier_share}(random)) {
              delay += std::exponential_distribution{1 / (15 * median_ns)}(random);
            }
            return delay;
          },
          1 / (information * (1 - outlier_share))};
}

struct SyncSignal {
  double period_ns{1e6};
  double offset_ppm{17};
  double phase_wander_ns_per_sqrt_s{10};
  double frequency_wander_ppb_per_sqrt_s{20};
  StampJitter jitter{StampJitter::gaussian(5000)};
  double missing{};
  double doubled{};
  double spurious{};
  double lost_by_kernel{};
  // Bursts of missing edges: length and distance are uniform between their limits; none while the distance is 0.
  std::int64_t fewest_in_burst{20};
  std::int64_t most_in_burst{200};
  double burst_after_at_least_s{};
  double burst_after_at_most_s{};
};

// An edge as stamped, and the tick that it belongs to (none for a spurious one; a bounce belongs to none either).
struct StampedEdge {
  Edge edge;
  std::optional<std::int64_t> tick;
};

// Simulates the two-state model that the clock assumes: true times and the edges that the kernel stamps.
class SyncSource {
 public:
  SyncSource(const SyncSignal& signal, std::uint64_t seed, MonoTime start = monoTime(1'234'567'890'123))
      : signal_{signal}, random_{seed}, start_ns_{toNs(start)} {
    drift_ns_ = signal.period_ns * signal.offset_ppm * 1e-6;
  }

  std::int64_t tick() const { return tick_; }
  // True time of the tick minus `at`, ns.
  double trueNsAfter(MonoTime at) const {
    return static_cast<double>(start_ns_ + tick_ * std::llround(signal_.period_ns) - toNs(at)) + phase_ns_;
  }
  double driftNs() const { return drift_ns_; }
  std::uint64_t missing() const { return missing_; }
  std::uint64_t lostByKernel() const { return lost_by_kernel_; }
  void setDriftNs(double drift_ns) { drift_ns_ = drift_ns; }
  void jump(double phase_ns) { phase_ns_ += phase_ns; }

  // Advances to the next tick and delivers its edges in the order of their stamps.
  template <class Take>
  void next(Take&& take) {
    step();
    std::array<StampedEdge, 3> edges;
    std::size_t count = 0;
    const bool in_burst = inBurst();
    const bool is_missing = chance(signal_.missing) || in_burst;
    const bool is_lost = !is_missing && chance(signal_.lost_by_kernel);
    missing_ += is_missing ? 1 : 0;
    lost_by_kernel_ += is_lost ? 1 : 0;
    if (is_lost) ++sequence_;
    const double edge_ns = signal_.jitter.draw_ns(random_);
    if (!is_missing && !is_lost) {
      edges[count++] = {edgeAt(edge_ns), tick_};
      if (chance(signal_.doubled)) {
        const double bounce_ns = std::uniform_real_distribution{0.01, 0.2}(random_)*signal_.period_ns;
        edges[count++] = {edgeAt(edge_ns + bounce_ns), std::nullopt};
      }
    }
    if (chance(signal_.spurious)) {
      edges[count++] = {edgeAt(std::uniform_real_distribution{-0.5, 0.5}(random_)*signal_.period_ns), std::nullopt};
    }
    std::sort(edges.begin(), edges.begin() + static_cast<std::ptrdiff_t>(count),
              [](const auto& a, const auto& b) { return a.edge.at < b.edge.at; });
    for (std::size_t i = 0; i < count; ++i) {
      edges[i].edge.line_sequence = ++sequence_;
      take(edges[i]);
    }
  }

 private:
  void step() {
    const double seconds = signal_.period_ns * 1e-9;
    const double frequency_step_ns =
        signal_.frequency_wander_ppb_per_sqrt_s * 1e-9 * signal_.period_ns * std::sqrt(seconds);
    phase_ns_ += drift_ns_ + signal_.phase_wander_ns_per_sqrt_s * std::sqrt(seconds) * normal_(random_);
    drift_ns_ += frequency_step_ns * normal_(random_);
    ++tick_;
  }
  bool inBurst() {
    if (signal_.burst_after_at_most_s <= 0) return false;
    if (tick_ >= burst_end_) {
      const double seconds =
          std::uniform_real_distribution{signal_.burst_after_at_least_s, signal_.burst_after_at_most_s}(random_);
      burst_begin_ = tick_ + std::llround(seconds * 1e9 / signal_.period_ns);
      burst_end_ =
          burst_begin_ + std::uniform_int_distribution{signal_.fewest_in_burst, signal_.most_in_burst}(random_);
    }
    return tick_ >= burst_begin_;
  }
  bool chance(double probability) { return probability > 0 && std::bernoulli_distribution{probability}(random_); }
  Edge edgeAt(double offset_ns) const {
    return {.role = LineRole::sync,
            .line = 0,
            .level = Level::active,
            .line_sequence = 0,
            .at = monoTime(start_ns_ + tick_ * std::llround(signal_.period_ns) + std::llround(phase_ns_ + offset_ns))};
  }

  SyncSignal signal_;
  std::mt19937_64 random_;
  std::normal_distribution<double> normal_;
  std::int64_t start_ns_;
  std::int64_t tick_{};
  double phase_ns_{};
  double drift_ns_{};
  std::uint32_t sequence_{};
  std::uint64_t missing_{};
  std::uint64_t lost_by_kernel_{};
  std::int64_t burst_begin_{};
  std::int64_t burst_end_{};
};

// Posterior Cramer-Rao bound of the phase, ns, tick by tick: the information recursion of Tichavsky, Muravchik and
// Nehorai (1998) for the two-state model with known parameters, independent of the filter under test.
class PhaseBound {
 public:
  explicit PhaseBound(const SyncSignal& signal) : bound_ns2_{signal.jitter.bound_ns2} {
    const double seconds = signal.period_ns * 1e-9;
    phase_step_ = signal.phase_wander_ns_per_sqrt_s * std::sqrt(seconds);
    frequency_step_ = signal.frequency_wander_ppb_per_sqrt_s * 1e-9 * signal.period_ns * std::sqrt(seconds);
  }

  // Advances to the next tick. edges: number of its edges, 0 or 1, or the expected share. Returns the variance of its
  // phase, ns^2.
  double step(double edges) {
    const double information = edges / bound_ns2_;
    const double pa = a_ + 2 * b_ + c_ + phase_step_ * phase_step_;
    const double pb = b_ + c_;
    const double pc = c_ + frequency_step_ * frequency_step_;
    // (P^-1 + diag(information, 0))^-1
    const double shrink = 1 / (1 + information * pa);
    a_ = pa * shrink;
    b_ = pb * shrink;
    c_ = pc - information * pb * pb * shrink;
    return a_;
  }

 private:
  double bound_ns2_;
  double phase_step_{};
  double frequency_step_{};
  // var(phase), cov, var(drift)
  double a_{1e12};
  double b_{};
  double c_{1e6};
};

// The same bound in the steady state of single losses.
inline double phaseBoundNs(const SyncSignal& signal) {
  PhaseBound bound{signal};
  double variance = 0;
  for (int i = 0; i < 200'000; ++i) variance = bound.step((1 - signal.missing) * (1 - signal.lost_by_kernel));
  return std::sqrt(variance);
}

}  // namespace probebox::support
