#pragma once
#include <cstdint>
#include <deque>
#include <optional>
#include <vector>

#include "firmware/clock/estimator.hpp"
#include "firmware/clock/tick_map.hpp"
#include "host-tests/support/sanitized.hpp"
#include "host-tests/support/sync_signal.hpp"

namespace probebox::clock_test {

inline constexpr std::int64_t kLong = support::kSanitized ? 100'000 : 1'000'000;

// A sync signal and a clock that listens to it; keeps the truth beside every verdict.
class Trial {
 public:
  struct Labelled {
    clock::Verdict verdict;
    std::optional<std::int64_t> true_tick;
  };

  Trial(const support::SyncSignal& signal, std::uint64_t seed, const clock::ClockConfig& config = {})
      : source{signal, seed}, estimator{config} {}

  // Steps the signal by one tick; calls take(Labelled) for every verdict.
  template <class Take>
  void step(Take&& take) {
    source.next([&](const support::StampedEdge& stamped) {
      last_edge = stamped.edge.at;
      pending_.push_back(stamped.tick);
      for (const auto& verdict : estimator.push(stamped.edge)) take(labelled(verdict));
    });
  }
  void step() {
    step([](const Labelled&) {});
  }
  void steps(std::int64_t count) {
    while (count-- > 0) step();
  }

  // Ticks on without an edge reaching the clock; time passes.
  void silence(std::int64_t ticks) {
    while (ticks-- > 0) {
      source.next([](const support::StampedEdge&) {});
      const MonoTime now = last_edge + Nanoseconds{static_cast<std::int64_t>(source.trueNsAfter(last_edge))};
      estimator.advance(now + estimator.config().delivery_latency);
    }
  }

  // The map's error at the tick that the source is at, ns: estimated minus true. `index_offset`: estimator's index
  // minus source's.
  double errorNs(std::int64_t index_offset) const {
    const TickMap map = estimator.map();
    return -source.trueNsAfter(clock::timeOf(map, Tick{source.tick() + index_offset}));
  }

  // The same for the estimator's tick that is nearest to the source's.
  double phaseErrorNs() const {
    const TickMap map = estimator.map();
    const auto true_ns = static_cast<std::int64_t>(source.trueNsAfter(map.at));
    const Nanoseconds half_period{(map.period_q32_ns >> 32) / 2};
    const Tick nearest = clock::tickBefore(map, map.at + Nanoseconds{true_ns} + half_period);
    return -source.trueNsAfter(clock::timeOf(map, nearest));
  }

  support::SyncSource source;
  clock::ClockEstimator estimator;
  MonoTime last_edge{};

 private:
  // Verdicts come at most a few edges late, so only the last truths are kept.
  Labelled labelled(const clock::Verdict& verdict) {
    while (pending_.size() > 64) {
      pending_.pop_front();
      ++first_pending_;
    }
    return {verdict, pending_.at(static_cast<std::size_t>(verdict.edge - first_pending_))};
  }

  std::deque<std::optional<std::int64_t>> pending_;
  std::uint64_t first_pending_{};
};

}  // namespace probebox::clock_test
