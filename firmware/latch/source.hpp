#pragma once
#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>

#include "firmware/latch/interpolation.hpp"
#include "firmware/latch/trace.hpp"
#include "protocol/units/time.hpp"

namespace probebox::latch {

// Interpolation between stamps Ts apart (docs/metrology.md A.9): linear errs by at most Ts^2/8 |x''|, cubic (4 points,
// Lagrange) by (3/128) Ts^4 |x''''|. Cubic waits for one more stamp and rings at a kink, so it suits encoders better
// than a touching probe.
enum class Interpolation : std::uint8_t { linear, cubic };

struct SourceConfig {
  Nanoseconds interval{
      1'000'000};  // nominal interval between stamps; zero: not fitted, the channel is 0 and samples do not wait for it
  Interpolation interpolation{Interpolation::linear};
};

// Buffered stamps: those that arrive within `kept`, plus a reserve.
inline std::size_t stampsKept(const SourceConfig& source, Nanoseconds kept) {
  constexpr std::size_t kFewest = 64, kSpare = 8;
  if (source.interval.count() <= 0) return 1;
  return std::max(kFewest, static_cast<std::size_t>(kept / source.interval) + kSpare);
}

enum class Answer : std::uint8_t {
  waiting,  // the source has not reached this time yet
  gap,      // it has, and there is no pair of stamps close enough around the time: nothing is extrapolated
  value,
};

// Buffers one stream of stamped integers with kWidth channels and interpolates it at increasing times.
template <std::size_t kWidth>
class Source {
 public:
  using Values = std::array<std::int64_t, kWidth>;
  enum class Pushed : std::uint8_t { taken, disordered, overwrote };

  // kept: how long a sample may wait for its data.
  Source(const SourceConfig& config, Nanoseconds kept)
      : interval_{config.interval},
        is_cubic_{config.interpolation == Interpolation::cubic},
        trace_{stampsKept(config, kept)} {}

  bool fitted() const { return interval_.count() > 0; }

  Pushed push(MonoTime at, const Values& values, bool clipped = false) {
    if (!trace_.empty() && at <= trace_.back().at) return Pushed::disordered;
    const bool was_full = trace_.full();
    if (was_full) trace_.pop();
    trace_.push({at, {values, clipped}});
    return was_full ? Pushed::overwrote : Pushed::taken;
  }

  // Shifts the buffered stamps and all future ones in time.
  void shift(Nanoseconds by) { trace_.shift(by); }

  // patient: wait for the fourth stamp of a cubic. Otherwise, and across a gap, interpolation is linear.
  Answer at(MonoTime t, bool patient, Values& values, bool& clipped) {
    if (!fitted()) return values = {}, Answer::value;
    while (trace_.size() >= 3 && trace_[2].at <= t) trace_.pop();
    if (trace_.empty() || trace_.back().at < t) return Answer::waiting;
    if (trace_.front().at > t) return Answer::gap;
    const std::size_t before = trace_.size() >= 2 && trace_[1].at <= t ? 1 : 0;
    if (trace_[before].at == t) return read(before, before, values, clipped);
    if (isGap(before)) return Answer::gap;
    if (!is_cubic_) return interpolate<2>(t, before, values, clipped);
    if (trace_.size() < before + 3) {
      return patient ? Answer::waiting : interpolate<2>(t, before, values, clipped);
    }
    const bool has_four = before == 1 && !isGap(0) && !isGap(2);
    return has_four ? interpolate<4>(t, 0, values, clipped) : interpolate<2>(t, before, values, clipped);
  }

 private:
  struct Reading {
    Values values{};
    bool clipped{};
  };

  // A gap is more than 2.5 nominal intervals between stamps (A.9).
  bool isGap(std::size_t i) const { return 2 * (trace_[i + 1].at - trace_[i].at) > 5 * interval_; }

  Answer read(std::size_t first, std::size_t last, Values& values, bool& clipped) const {
    values = trace_[first].value.values;
    for (std::size_t i = first; i <= last; ++i) clipped = clipped || trace_[i].value.clipped;
    return Answer::value;
  }

  template <std::size_t kPoints>
  Answer interpolate(MonoTime t, std::size_t first, Values& values, bool& clipped) const {
    read(first, first + kPoints - 1, values, clipped);
    std::array<MonoTime, kPoints> at;
    for (std::size_t i = 0; i < kPoints; ++i) at[i] = trace_[first + i].at;
    for (std::size_t channel = 0; channel < kWidth; ++channel) {
      std::array<std::int64_t, kPoints> points;
      for (std::size_t i = 0; i < kPoints; ++i) points[i] = trace_[first + i].value.values[channel];
      if constexpr (kPoints == 2) {
        values[channel] = linear(t, at, points);
      } else {
        values[channel] = cubic(t, at, points);
      }
    }
    return Answer::value;
  }

  Nanoseconds interval_;
  bool is_cubic_;
  Trace<Reading> trace_;
};

}  // namespace probebox::latch
