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
        trace_{stampsKept(config, kept)},
        reach_{fitted() ? MonoTime::min() : MonoTime::max()} {}

  bool fitted() const { return interval_.count() > 0; }

  Pushed push(MonoTime at, const Values& values, bool clipped = false) {
    if (!trace_.empty() && at <= trace_.back().at) return Pushed::disordered;
    const bool was_full = trace_.full();
    if (was_full) trace_.pop();
    trace_.push({at, {values, clipped}});
    if (fitted()) reach_ = at;
    return was_full ? Pushed::overwrote : Pushed::taken;
  }

  // Shifts the buffered stamps and all future ones in time.
  void shift(Nanoseconds by) {
    trace_.shift(by);
    if (!trace_.empty() && fitted()) reach_ += by;
    present_ = {};
  }

  // Whether there are stamps up to that time, without which it has to wait.
  bool reaches(MonoTime t) const { return reach_ >= t; }

  // patient: wait for the fourth stamp of a cubic. Otherwise, and across a gap, interpolation is linear.
  Answer at(MonoTime t, bool patient, Values& values, bool& clipped) {
    if (!fitted()) return values = {}, Answer::value;
    if (present_.holds(t)) return give(t, values, clipped);
    while (trace_.size() >= 3 && trace_[2].at <= t) trace_.pop();
    if (!reaches(t)) return Answer::waiting;
    if (trace_.front().at > t) return Answer::gap;
    const std::size_t before = trace_.size() >= 2 && trace_[1].at <= t ? 1 : 0;
    const auto& [at, reading] = trace_[before];
    if (at == t) return values = reading.values, clipped = clipped || reading.clipped, Answer::value;
    if (isGap(before)) return Answer::gap;
    const bool lacks_fourth = is_cubic_ && trace_.size() < before + 3;
    if (lacks_fourth && patient) return Answer::waiting;
    const bool has_four = is_cubic_ && !lacks_fourth && before == 1 && !isGap(0) && !isGap(2);
    has_four ? interpolate<4>(0) : interpolate<2>(before);
    const Answer answer = give(t, values, clipped);
    if (lacks_fourth) present_ = {};  // the next time may have it
    return answer;
  }

 private:
  struct Reading {
    Values values{};
    bool clipped{};
  };

  // A gap is more than 2.5 nominal intervals between stamps (A.9).
  bool isGap(std::size_t i) const { return 2 * (trace_[i + 1].at - trace_[i].at) > 5 * interval_; }

  Answer give(MonoTime t, Values& values, bool& clipped) const {
    values = present_.at(t);
    clipped = clipped || present_clipped_;
    return Answer::value;
  }

  template <std::size_t kPoints>
  void interpolate(std::size_t first) {
    std::array<MonoTime, kPoints> at;
    std::array<Values, kPoints> values;
    present_clipped_ = false;
    for (std::size_t i = 0; i < kPoints; ++i) {
      at[i] = trace_[first + i].at;
      values[i] = trace_[first + i].value.values;
      present_clipped_ = present_clipped_ || trace_[first + i].value.clipped;
    }
    present_ = {at, values};
  }

  Nanoseconds interval_;
  bool is_cubic_;
  Trace<Reading> trace_;
  MonoTime reach_;            // of the latest stamp
  Interval<kWidth> present_;  // that the latest time lay in
  bool present_clipped_{};
};

}  // namespace probebox::latch
