#pragma once
#include <memory>

#include "tools/link/uri.hpp"
#include "tools/probebox/cli/console.hpp"
#include "tools/probebox/cli/request.hpp"
#include "tools/probebox/screen/terminal_screen.hpp"

namespace probebox::command {

// Runs `watch` on the whole terminal until q, Ctrl-C, or the limit in `options`.
ExitStatus watchOnScreen(const Watch& options, const link::Uri& uri, std::unique_ptr<TerminalScreen> screen,
                         Console& console);

}  // namespace probebox::command
