#pragma once
#include "tools/probebox/cli/console.hpp"
#include "tools/probebox/cli/request.hpp"

namespace probebox::command {

// Lists boxes on USB (and whether they can be opened) and boxes that run on this computer, then reports each that
// appears or disappears. No box is opened, so no link is disturbed. Each line or object is one update of `until`.
ExitStatus watchPlugs(const Until& until, Console& console);

}  // namespace probebox::command
