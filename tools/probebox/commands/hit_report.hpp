#pragma once
#include "tools/interference/check.hpp"
#include "tools/probebox/cli/json.hpp"

namespace probebox::command {

// Describes a hit, or the smallest distance, as JSON.
Json describe(const interference::Hit& hit);

}  // namespace probebox::command
