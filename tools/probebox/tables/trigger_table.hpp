#pragma once
#include <optional>
#include <span>
#include <string>

#include "protocol/messages/stream.hpp"

namespace probebox::command {

// Writes triggers as a table, one row each: CSV, or a structured array of NumPy if the name ends with .npy. Unknown
// positions and angles are empty (nan in NumPy). Returns why it could not be written.
std::optional<std::string> writeTriggers(const std::string& path, bool force,
                                         std::span<const messages::Trigger> triggers);

}  // namespace probebox::command
