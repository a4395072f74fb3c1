#pragma once
#include "board/describe/machine.hpp"
#include "board/describe/section.hpp"
#include "board/describe/world.hpp"

// The shank of the stylus: [probe_shank] of machine.toml, and [probe_spindle.shank] of world.toml.
namespace probebox::board {

// After the tools, of which one carries it.
void readProbeShank(Section& root, Machine& machine);
// Into the first tool of the spindle; nothing where it is not described.
void readWorldShank(Section& spindle, WorldProbeSpindle& described);

}  // namespace probebox::board
