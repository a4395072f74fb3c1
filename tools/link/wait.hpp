#pragma once
#include <atomic>
#include <chrono>
#include <functional>
#include <optional>

#include "protocol/units/time.hpp"

namespace probebox::link {

// Waits until the descriptor is readable (or writable, when asked for) or a short time has passed, and returns the
// time; nothing once the time limit is over. Tests pass their own, without a clock.
using Wait = std::function<std::optional<MonoTime>(int descriptor, bool for_writing)>;

// Time of CLOCK_MONOTONIC.
MonoTime now();

// Returns a Wait on the real clock whose time limit begins now. `interrupted` (Ctrl-C) ends it early and may be null.
Wait patience(std::chrono::milliseconds limit, const std::atomic<bool>* interrupted = nullptr);

}  // namespace probebox::link
