#pragma once
#include <cstddef>

#include "board/describe/section.hpp"

// U, V, W are linear axes parallel to X, Y, Z (ISO 841), such as a quill. The box counts one position a direction, so
// it refuses them by name, with the remedy.
namespace probebox::board {

// Refuses each of them that has a table in `axes`.
void refuseSecondaryAxes(Section& axes);

// Reads "axis" of a section, X, Y or Z; returns 0 to 2.
std::size_t linearAxisOf(Section& section);

}  // namespace probebox::board
