#pragma once
#include <string>

#include "tools/probebox/cli/console.hpp"
#include "tools/probebox/cli/request.hpp"

namespace probebox::command {

// Gives the front end on this computer another program, by its boot loader's drive. `given`: the value of -u.
ExitStatus updateFrontEnd(const Update& options, const std::string& given, Console& console);

}  // namespace probebox::command
