#pragma once
#include "board/describe/machine.hpp"
#include "board/describe/section.hpp"

// Reads the sections of machine.toml about rotary axes. Private to the room.
namespace probebox::board {

// Reads [rotary_axis.A] to [rotary_axis.C], [swivel], [rotary_table] and [[tool]], all optional. hold_s: the default
// for sources without one.
void readRotary(Section& root, double hold_s, Machine& machine);

}  // namespace probebox::board
