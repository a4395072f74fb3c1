#pragma once
#include <string>
#include <string_view>

namespace CLI {
class App;
}

namespace probebox::pages {

// Writes the manual page of a command from the same declarations as its --help. section: 1 or 8.
std::string manPage(const CLI::App& command, char section, std::string_view name, std::string_view purpose);

}  // namespace probebox::pages
