#pragma once
#include "protocol/events/event.hpp"

namespace probebox::capture {

inline constexpr TickMap kLocked{.tick = {100},
                                 .at = monoTime(100'000'000),
                                 .period_q32_ns = std::int64_t{1'000'000} << 32,
                                 .sigma_ns = 500,
                                 .state = ClockState::locked,
                                 .holdover_ms = 0};

}  // namespace probebox::capture
