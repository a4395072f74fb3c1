#pragma once
#include <span>
#include <string>

#include "tools/probebox/cli/console.hpp"

namespace probebox::command {

// Runs the whole command. arguments: without the program's name.
ExitStatus run(std::span<const std::string> arguments, const Streams& streams);

}  // namespace probebox::command
