#pragma once
#include "tools/probebox/cli/console.hpp"
#include "tools/probebox/cli/request.hpp"

namespace probebox::command {

// Tells what is there, and then what comes and goes: boxes on USB with whether they can be opened, and boxes that run
// on this computer. No box is opened for it, so nobody's link is disturbed. Each line or object is an update of
// `until`.
ExitStatus watchPlugs(const Until& until, Console& console);

}  // namespace probebox::command
