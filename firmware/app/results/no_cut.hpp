#pragma once
#include <functional>
#include <mutex>
#include <optional>

namespace probebox::app {

// While it exists no door declares a cut: whoever does so waits. Hold it briefly.
using NoCut = std::unique_lock<std::timed_mutex>;

// Nothing while a door declares that a cut is on.
using KeepCutsOut = std::function<std::optional<NoCut>()>;

// Whether the newest state of the core has a cut. A line rises when it likes: nothing keeps it out.
using CutSeen = std::function<bool()>;

}  // namespace probebox::app
