#pragma once
#include <optional>

#include "tools/probebox/link/box.hpp"

namespace probebox::command {

// The status once the master clock is locked, or after 20 s: a box that has just started needs a moment.
Outcome<messages::Status::Answer, Trouble> settledStatus(link::Client& box, Console& console);

// Why a box must not be disturbed now: a measuring procedure or a cut is on.
std::optional<Trouble> whyNotAtRest(link::Client& box, const Console& console);

}  // namespace probebox::command
