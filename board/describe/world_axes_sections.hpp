#pragma once
#include "board/describe/section.hpp"
#include "board/describe/world.hpp"

// Reads the errors of the axes and the switch of the emulated machine: [linear_axes], [touch_trigger] and the error_
// keys of rotary axes in world.toml.
namespace probebox::board {

// Returns zeros where the section is absent.
void readLinearAxes(Section& root, World& world);
void readTouchTrigger(Section& root, World& world);
WorldAxisErrors readAxisErrors(Section& section);
// [[part_spindle.further_mount]]
WorldMount readWorldMount(Section& section);

}  // namespace probebox::board
