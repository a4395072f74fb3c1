#pragma once
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <vector>

#include "trial.hpp"

// Judges the clock over gaps: every tick's error against the posterior Cramer-Rao bound of the edges that there were.
namespace probebox::clock_test {

// The four cases of jitter and wander that the clock is judged by.
inline std::array<support::SyncSignal, 4> fourCases() {
  using support::StampJitter;
  std::array<support::SyncSignal, 4> cases;
  cases[0].jitter = StampJitter::gaussian(5000);
  cases[1].jitter = StampJitter::lognormal(10000, 0.5, 0.01);
  cases[2].jitter = StampJitter::lognormal(30000, 0.5, 0.02);
  cases[3].jitter = cases[1].jitter;
  cases[3].phase_wander_ns_per_sqrt_s *= 10;
  cases[3].frequency_wander_ppb_per_sqrt_s *= 10;
  for (auto& one : cases) one.missing = one.doubled = one.spurious = 0.005;
  return cases;
}

// The same with 20 to 200 missing ticks every 2 to 5 s.
inline support::SyncSignal withGaps(support::SyncSignal signal) {
  signal.burst_after_at_least_s = 2;
  signal.burst_after_at_most_s = 5;
  return signal;
}

struct GapAccuracy {
  double rms_ns{};
  double bound_ns{};
  double pull{};            // mean of (error / stated sigma)^2 over all ticks
  double pull_in_gaps{};    // the same of ticks without an edge
  double worst_to_rms{};    // 99.9 % of the errors at ticks with an edge, in RMS of their run
  std::int64_t shifted{};   // ticks whose index is another one than at the begin
  std::uint32_t epochs{1};  // the most of a run

  double ratio() const { return rms_ns / bound_ns; }
};

// One run. The constant bias of the stamps cannot be seen and is taken out.
class GapRun {
 public:
  GapRun(const support::SyncSignal& signal, std::uint64_t seed) : trial_{signal, seed}, bound_{signal} {}

  void skip(std::int64_t ticks) {
    while (ticks-- > 0) step();
    offset_ = nearestTick() - trial_.source.tick();
  }

  // silent: no edge reaches the clock meanwhile.
  void judge(std::int64_t ticks, bool silent = false) {
    while (ticks-- > 0) {
      const bool has_edge = step(silent);
      const auto stamp = trial_.estimator.stamp(truth());
      errors_ns_.push_back(trial_.errorNs(offset_));
      sigmas_ns_.push_back(stamp ? stamp->sigma_ns : 1e9);
      in_gap_.push_back(!has_edge);
      bound_ns2_ += bound_now_ns2_;
      shifted_ += nearestTick() - trial_.source.tick() == offset_ ? 0 : 1;
    }
  }

  // Sums over the ticks, to be divided by their number. in_rms: takes the errors at ticks with an edge.
  void addTo(GapAccuracy& sums, std::int64_t& count, std::int64_t& gap_count, std::vector<double>& in_rms) const {
    double mean = 0;
    for (const double error : errors_ns_) mean += error / static_cast<double>(errors_ns_.size());
    double variance = 0;
    for (const double error : errors_ns_)
      variance += (error - mean) * (error - mean) / static_cast<double>(errors_ns_.size());
    for (std::size_t i = 0; i < errors_ns_.size(); ++i) {
      const double square = (errors_ns_[i] - mean) * (errors_ns_[i] - mean);
      const double pull = square / (sigmas_ns_[i] * sigmas_ns_[i]);
      sums.rms_ns += square;
      sums.pull += pull;
      sums.pull_in_gaps += in_gap_[i] ? pull : 0;
      gap_count += in_gap_[i] ? 1 : 0;
      if (!in_gap_[i]) in_rms.push_back(std::sqrt(square / variance));
    }
    sums.bound_ns += bound_ns2_;
    sums.shifted += shifted_;
    sums.epochs = std::max(sums.epochs, trial_.estimator.epoch());
    count += static_cast<std::int64_t>(errors_ns_.size());
  }

 private:
  bool step(bool silent = false) {
    bool has_edge = false;
    trial_.source.next([&](const support::StampedEdge& stamped) {
      if (silent) return;
      trial_.last_edge = stamped.edge.at;
      has_edge |= stamped.tick.has_value();
      trial_.estimator.push(stamped.edge);
    });
    trial_.estimator.advance(truth());
    bound_now_ns2_ = bound_.step(has_edge ? 1 : 0);
    return has_edge;
  }
  MonoTime truth() const {
    return trial_.last_edge + Nanoseconds{std::llround(trial_.source.trueNsAfter(trial_.last_edge))};
  }
  std::int64_t nearestTick() const {
    const TickMap map = trial_.estimator.map();
    return clock::tickBefore(map, truth() + Nanoseconds{(map.period_q32_ns >> 32) / 2}).index;
  }

  Trial trial_;
  support::PhaseBound bound_;
  double bound_now_ns2_{};
  double bound_ns2_{};
  std::int64_t offset_{};
  std::int64_t shifted_{};
  std::vector<double> errors_ns_;
  std::vector<double> sigmas_ns_;
  std::vector<bool> in_gap_;
};

// Over runs of seeds 0, 1, ...: from `from_s` to `to_s`, with a gap of `silent_ticks` after a third of that.
inline GapAccuracy accuracyOverGaps(const support::SyncSignal& signal, int runs, int from_s, int to_s,
                                    std::int64_t silent_ticks = 0) {
  const double ticks_per_s = 1e9 / signal.period_ns;
  const std::int64_t ticks = std::llround((to_s - from_s) * ticks_per_s);
  GapAccuracy sums;
  std::vector<double> in_rms;
  std::int64_t count = 0;
  std::int64_t gap_count = 0;
  for (int seed = 0; seed < runs; ++seed) {
    GapRun run{signal, static_cast<std::uint64_t>(seed)};
    run.skip(std::llround(from_s * ticks_per_s));
    run.judge(ticks / 3);
    run.judge(silent_ticks, true);
    run.judge(ticks - ticks / 3 - silent_ticks);
    run.addTo(sums, count, gap_count, in_rms);
  }
  const auto worst = in_rms.begin() + static_cast<std::ptrdiff_t>(in_rms.size() * 999 / 1000);
  std::nth_element(in_rms.begin(), worst, in_rms.end());
  const auto n = static_cast<double>(count);
  return {.rms_ns = std::sqrt(sums.rms_ns / n),
          .bound_ns = std::sqrt(sums.bound_ns / n),
          .pull = sums.pull / n,
          .pull_in_gaps = sums.pull_in_gaps / static_cast<double>(std::max<std::int64_t>(1, gap_count)),
          .worst_to_rms = *worst,
          .shifted = sums.shifted,
          .epochs = sums.epochs};
}

}  // namespace probebox::clock_test
