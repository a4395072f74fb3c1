#pragma once
#include "tools/interference/check.hpp"
#include "tools/probebox/cli/json.hpp"

namespace probebox::command {

// A hit, or the smallest distance, for programs.
Json describe(const interference::Hit& hit);

}  // namespace probebox::command
