#pragma once
#include <filesystem>
#include <fstream>
#include <optional>
#include <string>

#include "protocol/units/outcome.hpp"

namespace probebox {

// Says why a path is not read as a file: it is a device, a socket, or a pipe with a name, whose end may never come.
// Nothing for files, folders and what does not exist, nor for a pipe that the shell has opened (/dev/fd/63).
std::optional<std::string> whyNoPlainInput(const std::filesystem::path& path);

// Opens a file to read its bytes, or says in a sentence with its name why not.
Outcome<std::ifstream> openPlainInput(const std::filesystem::path& path);

}  // namespace probebox
