#pragma once
#include <atomic>
#include <chrono>
#include <functional>
#include <optional>

#include "protocol/units/time.hpp"

namespace probebox::link {

// Waits until the descriptor is readable (or writable, when asked for) or a short while has passed, and says what time
// it is; nothing when the caller has no more patience. Tests give one of their own, without a clock.
using Wait = std::function<std::optional<MonoTime>(int descriptor, bool for_writing)>;

// CLOCK_MONOTONIC.
MonoTime now();

// The real one: patience counts from this call. `interrupted` (Ctrl-C) ends it early and may be null.
Wait patience(std::chrono::milliseconds limit, const std::atomic<bool>* interrupted = nullptr);

}  // namespace probebox::link
