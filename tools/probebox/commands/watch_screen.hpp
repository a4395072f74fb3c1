#pragma once
#include <memory>

#include "tools/link/uri.hpp"
#include "tools/probebox/cli/console.hpp"
#include "tools/probebox/cli/request.hpp"
#include "tools/probebox/screen/terminal_screen.hpp"

namespace probebox::command {

// `watch` of a box on a whole screen, until q, Ctrl-C or the end that was asked for.
ExitStatus watchOnScreen(const Watch& options, const link::Uri& uri, std::unique_ptr<TerminalScreen> screen,
                         Console& console);

}  // namespace probebox::command
