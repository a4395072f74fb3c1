#pragma once
#include <filesystem>
#include <optional>
#include <string>

namespace probebox {

// Says why a path is not read as a file: it is a device, a socket, or a pipe with a name, whose end may never come.
// Nothing for files, folders and what does not exist, nor for a pipe that the shell has opened (/dev/fd/63).
std::optional<std::string> whyNoPlainInput(const std::filesystem::path& path);

}  // namespace probebox
