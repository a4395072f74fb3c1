#pragma once
#include <array>
#include <optional>

#include "protocol/events/event.hpp"
#include "protocol/units/time.hpp"

namespace probebox::corrections {

// How a rotary axis stands, as far as anybody knows.
struct AngleNow {
  std::optional<double> rad;  // nothing without a reference, or before it was told
  bool doubtful{};            // nobody has said so for too long
};

// Where the machine was at one tick: what drives every source of corrections.
struct MachineTick {
  MonoTime at{};
  double elapsed_s{};                                            // since the tick before
  std::array<std::optional<double>, kLinearAxes> position_mm{};  // nothing for an axis without a reference
  std::array<double, kLinearAxes> speed_mm_s{};
  std::array<AngleNow, kRotaryAxes> angles{};  // A B C
  std::optional<double> tool_length_mm{};      // nothing without a tool, or for one whose length nobody knows
};

}  // namespace probebox::corrections
