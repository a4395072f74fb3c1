#pragma once
#include "board/describe/machine.hpp"
#include "board/describe/section.hpp"

// The ball screws of machine.toml: [screw.X] to [screw.Z], each of them optional. Inside of this room only.
namespace probebox::board {

// After the axes, whose nuts run on them. hold_s: where a screw says nothing else.
void readScrews(Section& root, double hold_s, Machine& machine);

}  // namespace probebox::board
