#pragma once
#include <cstddef>
#include <cstdint>

#include "protocol/events/event.hpp"

namespace probebox::io {

// One of the axes that may have an encoder, by its place in X Y Z A B C, and the events about it.
class EncoderAxis {
 public:
  explicit constexpr EncoderAxis(std::size_t number) : number_{number} {}

  constexpr bool isLinear() const { return number_ < kLinearAxes; }
  constexpr char letter() const { return "XYZABC"[number_]; }
  constexpr std::uint8_t bit() const { return static_cast<std::uint8_t>(1U << number_); }

  // The counts of the axis at `at`.
  Event count(std::uint32_t sequence, std::int64_t counts, MonoTime at) const {
    if (isLinear()) return Count{static_cast<Axis>(number_), sequence, counts, at};
    return AngleCount{static_cast<RotaryAxis>(number_ - kLinearAxes), sequence, counts, at};
  }
  // A pulse of its index mark.
  Event index(std::uint32_t sequence, MonoTime at) const {
    return Edge{LineRole::index, static_cast<std::uint8_t>(number_), Level::active, sequence, at};
  }
  // The encoder is gone (disconnected), or its counts do not continue the last ones (overrun).
  Event lost(LossReason reason, std::uint32_t events, MonoTime at) const {
    return SourceLost{Source::encoders, reason, events, at, bit()};
  }

 private:
  std::size_t number_;
};

}  // namespace probebox::io
