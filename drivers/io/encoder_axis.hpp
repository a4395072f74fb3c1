#pragma once
#include <cstddef>
#include <cstdint>

#include "protocol/events/event.hpp"

namespace probebox::io {

// One of the axes that may have an encoder, by its place in X Y Z A B C U V W, and the events about it. Those of U, V
// and W name the axis that they are parallel to: its position is the sum of both (SummedCounts).
class EncoderAxis {
 public:
  explicit constexpr EncoderAxis(std::size_t number) : number_{number} {}

  static constexpr std::size_t kSecondary = 2 * kLinearAxes;  // place of U

  constexpr bool isLinear() const { return place() < kLinearAxes; }
  constexpr char letter() const { return "XYZABCUVW"[number_]; }
  constexpr std::uint8_t bit() const { return static_cast<std::uint8_t>(1U << place()); }

  // The counts of the axis at `at`.
  Event count(std::uint32_t sequence, std::int64_t counts, MonoTime at) const {
    if (isLinear()) return Count{static_cast<Axis>(place()), sequence, counts, at};
    return AngleCount{static_cast<RotaryAxis>(place() - kLinearAxes), sequence, counts, at};
  }
  // A pulse of its index mark.
  Event index(std::uint32_t sequence, MonoTime at) const {
    return Edge{LineRole::index, static_cast<std::uint8_t>(place()), Level::active, sequence, at};
  }
  // The encoder is gone (disconnected), or its counts do not continue the last ones (overrun).
  Event lost(LossReason reason, std::uint32_t events, MonoTime at) const {
    return SourceLost{Source::encoders, reason, events, at, bit()};
  }

 private:
  constexpr std::size_t place() const { return number_ < kSecondary ? number_ : number_ - kSecondary; }

  std::size_t number_;
};

}  // namespace probebox::io
