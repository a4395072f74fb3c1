#pragma once
#include <string>
#include <vector>

namespace CLI {
class App;
}

namespace probebox::pages {

// Writes the completion script of a shell: commands, options and their choices, else file names.
// methods: the ones that `calibrate`, `plan` and `gcode` take.
std::string bashCompletion(const CLI::App& command, const std::vector<std::string>& methods);
std::string zshCompletion(const CLI::App& command, const std::vector<std::string>& methods);

}  // namespace probebox::pages
