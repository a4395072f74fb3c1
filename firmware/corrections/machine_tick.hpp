#pragma once
#include <array>
#include <optional>

#include "protocol/events/event.hpp"
#include "protocol/units/time.hpp"

namespace probebox::corrections {

// Angle of one rotary axis, as far as it is known.
struct AngleNow {
  std::optional<double> rad;  // nullopt without a reference, or before the controller sent it
  bool doubtful{};            // not confirmed for too long
};

// State of the machine at one tick: the input of every source of corrections.
struct MachineTick {
  MonoTime at{};
  bool by_counts{};                                              // no sample: positions of the latest counts
  double elapsed_s{};                                            // since the tick before
  std::array<std::optional<double>, kLinearAxes> position_mm{};  // nullopt for an axis without a reference
  std::array<bool, kLinearAxes> position_doubtful{};             // its encoder is silent
  std::array<double, kLinearAxes> speed_mm_s{};
  std::array<AngleNow, kRotaryAxes> angles{};  // A B C
  std::optional<double> tool_length_mm{};      // nothing without a tool, or if its length is unknown
};

}  // namespace probebox::corrections
