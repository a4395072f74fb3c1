#pragma once
#include "protocol/events/event.hpp"

namespace probebox::procedure {

// A master clock of 1 kHz that is locked.
inline constexpr TickMap kLocked{.tick = {},
                                 .at = {},
                                 .period_q32_ns = std::int64_t{1'000'000} << 32,
                                 .sigma_ns = 500,
                                 .state = ClockState::locked,
                                 .holdover_ms = 0};

}  // namespace probebox::procedure
