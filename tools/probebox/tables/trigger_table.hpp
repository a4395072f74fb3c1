#pragma once
#include <optional>
#include <span>
#include <string>

#include "protocol/messages/stream.hpp"

namespace probebox::command {

// Triggers as a table, one row each: CSV, or a structured array of NumPy where the name ends with .npy. Positions and
// angles that are not known are empty, nan for NumPy. Returns why it could not be written.
std::optional<std::string> writeTriggers(const std::string& path, bool force,
                                         std::span<const messages::Trigger> triggers);

}  // namespace probebox::command
