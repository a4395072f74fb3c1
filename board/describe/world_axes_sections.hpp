#pragma once
#include "board/describe/section.hpp"
#include "board/describe/world.hpp"

// What the axes and the switch of the emulated machine do wrong: [linear_axes], [touch_trigger] and the error_ keys of
// rotary axes in world.toml.
namespace probebox::board {

// All zero where the section is not there.
void readLinearAxes(Section& root, World& world);
void readTouchTrigger(Section& root, World& world);
WorldAxisErrors readAxisErrors(Section& section);
// [[part_spindle.further_mount]]
WorldMount readWorldMount(Section& section);

}  // namespace probebox::board
