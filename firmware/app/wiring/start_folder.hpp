#pragma once
#include <filesystem>
#include <optional>

#include "protocol/units/outcome.hpp"

namespace probebox::app {

// Writes commented descriptions to begin with into a folder, which is made when missing. Writes nothing where one of
// them is already there, and names it.
std::optional<Error> writeStartingDescriptions(const std::filesystem::path& folder);

}  // namespace probebox::app
