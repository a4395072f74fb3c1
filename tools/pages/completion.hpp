#pragma once
#include <string>
#include <vector>

namespace CLI {
class App;
}

namespace probebox::pages {

// What a shell offers when Tab is pressed behind `probebox`: commands, options, their choices, else names of files.
// `methods`: what `calibrate`, `plan` and `gcode` take.
std::string bashCompletion(const CLI::App& command, const std::vector<std::string>& methods);
std::string zshCompletion(const CLI::App& command, const std::vector<std::string>& methods);

}  // namespace probebox::pages
