#pragma once
#include "board/describe/machine.hpp"
#include "board/describe/section.hpp"

// Reads the ball screws of machine.toml: [screw.X] to [screw.Z], all optional. Private to the room.
namespace probebox::board {

// Call it after the axes have been read. hold_s: the default for screws without one.
void readScrews(Section& root, double hold_s, Machine& machine);

}  // namespace probebox::board
