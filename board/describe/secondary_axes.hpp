#pragma once
#include <cstddef>

#include "board/describe/box.hpp"
#include "board/describe/section.hpp"

// U, V, W are linear axes parallel to X, Y, Z (ISO 841), such as a quill. The box adds their positions up, and knows
// nothing else of them: everywhere but in [encoder] and [axis] they are refused by name, with the remedy.
namespace probebox::board {

// Refuses each of them that has a table in `axes`.
void refuseSecondaryAxes(Section& axes);

// Reads "axis" of a section, X, Y or Z; returns 0 to 2.
std::size_t linearAxisOf(Section& section);

}  // namespace probebox::board
