#pragma once
#include "board/describe/machine.hpp"
#include "board/describe/section.hpp"

// What machine.toml says about rotary axes. Inside of this room only, as section.hpp.
namespace probebox::board {

// [rotary_axis.A] to [rotary_axis.C], [swivel], [rotary_table] and [[tool]], each of them optional. hold_s: where a
// source says nothing else.
void readRotary(Section& root, double hold_s, Machine& machine);

}  // namespace probebox::board
