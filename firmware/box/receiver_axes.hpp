#pragma once
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "protocol/events/event.hpp"

namespace probebox::box {

// State of a receiver's axis counters from one sample to the next: the time of the sample, and whether the counts are
// continuous.
class ReceiverAxes {
 public:
  // The receiver's deflection with this number was taken at `at`; nullopt when its time is unknown.
  void placed(std::uint32_t counter, std::optional<MonoTime> at) {
    counter_ = counter;
    at_ = at;
  }
  // The time of these counts is that of the deflection before them.
  std::optional<MonoTime> timeOf(const CountedAxes& counted) const {
    return counted.counter == counter_ ? at_ : std::nullopt;
  }
  // Returns the axes, as bits, whose counts do not continue the last ones.
  std::uint8_t broken(const CountedAxes& counted) {
    const bool is_new_run = axes_ != 0 && counted.run != run_;
    run_ = counted.run;
    axes_ = counted.axes;
    return is_new_run ? counted.axes : counted.faults;
  }
  // Call when the receiver has gone and this was reported: a new run of the next counts is then not reported again.
  void forget() { axes_ = 0; }

  // Whether a loss of these axes, 0 for all, is of this receiver.
  bool isAmong(std::uint8_t axes) const { return axes == 0 || (axes & axes_) != 0; }
  std::size_t axes() const { return static_cast<std::size_t>(std::popcount(axes_)); }
  std::uint32_t nextIndex(std::size_t axis) { return ++indexes_.at(axis); }

 private:
  std::uint32_t counter_{};
  std::optional<MonoTime> at_;
  std::uint8_t run_{};
  std::uint8_t axes_{};
  std::array<std::uint32_t, kLinearAxes + kRotaryAxes> indexes_{};
};

}  // namespace probebox::box
