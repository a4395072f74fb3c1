#pragma once
#include <array>
#include <optional>

#include "protocol/events/event.hpp"
#include "protocol/units/time.hpp"

namespace probebox::corrections {

// Where the machine was at one tick: what drives every source of corrections.
struct MachineTick {
  MonoTime at{};
  double elapsed_s{};                                            // since the tick before
  std::array<std::optional<double>, kLinearAxes> position_mm{};  // nothing for an axis without a reference
  std::array<double, kLinearAxes> speed_mm_s{};
};

}  // namespace probebox::corrections
