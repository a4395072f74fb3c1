#pragma once
#include <filesystem>
#include <optional>

#include "protocol/units/outcome.hpp"

namespace probebox::app {

// Writes commented starting descriptions into a folder, which is made when missing. Writes nothing if one of them
// already exists; the error names it.
std::optional<Error> writeStartingDescriptions(const std::filesystem::path& folder);

}  // namespace probebox::app
