#pragma once
#include <span>
#include <string>

#include "tools/probebox/cli/console.hpp"

namespace probebox::command {

// The whole command: arguments without the program's name; returns the exit status.
ExitStatus run(std::span<const std::string> arguments, const Streams& streams);

}  // namespace probebox::command
