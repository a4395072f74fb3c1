#pragma once
#include <functional>
#include <mutex>
#include <optional>

namespace probebox::app {

// While it exists no connection declares a cut: whoever does so waits. Hold it briefly.
using CutLock = std::unique_lock<std::timed_mutex>;

// Locks out cuts; nothing while a connection declares that one is on.
using TryLockOutCuts = std::function<std::optional<CutLock>()>;

// Whether the newest state of the core has a cut. A line rises at any time: nothing locks it out.
using CutSeen = std::function<bool()>;

}  // namespace probebox::app
