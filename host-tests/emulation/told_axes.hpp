#pragma once
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <deque>
#include <functional>
#include <optional>
#include <random>
#include <utility>

#include "protocol/events/event.hpp"

namespace probebox::scenario {

// A controller that tells where its axes are, once a cycle, with the number of the cycle and over a way of varying
// length.
class ToldAxes {
 public:
  static constexpr Nanoseconds kCycle{2'000'000};
  // Of an arrival: a lognormal delay.
  static constexpr double kMedianNs = 700'000;
  static constexpr double kShape = 0.3;

  using Counts = std::function<std::array<std::int64_t, kLinearAxes>(MonoTime)>;

  ToldAxes(std::uint64_t seed, MonoTime start, Counts counts)
      : random_{seed}, cycle_at_{start}, counts_{std::move(counts)} {}

  // What has arrived by `now`, one at a time.
  std::optional<Event> next(MonoTime now) {
    for (; cycle_at_ <= now; cycle_at_ += kCycle, ++cycle_) {
      if (silent_) continue;
      ControlPositions told{.run = run_, .counter = cycle_, .axes = 7, .newest = true};
      const auto counts = counts_(cycle_at_);
      for (std::size_t axis = 0; axis < kLinearAxes; ++axis) told.counts[axis] = counts[axis];
      const auto late_ns = std::lognormal_distribution{std::log(kMedianNs), kShape}(random_);
      arrived_ = std::max(arrived_, cycle_at_ + Nanoseconds{std::llround(late_ns)});
      told.at = arrived_;
      waiting_.push_back(told);
    }
    if (waiting_.empty() || waiting_.front().at > now) return std::nullopt;
    const Event event = waiting_.front();
    waiting_.pop_front();
    return event;
  }

  void setSilent(bool silent) { silent_ = silent; }
  // The controller begins to count anew.
  void restart() { cycle_ = 0, ++run_; }

 private:
  std::mt19937_64 random_;
  MonoTime cycle_at_;
  Counts counts_;
  std::uint32_t cycle_{1'000'000};
  std::uint8_t run_{};
  bool silent_{};
  MonoTime arrived_{};
  std::deque<ControlPositions> waiting_;
};

}  // namespace probebox::scenario
