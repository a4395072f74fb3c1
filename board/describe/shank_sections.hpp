#pragma once
#include "board/describe/machine.hpp"
#include "board/describe/section.hpp"
#include "board/describe/world.hpp"

// Reads the shank of the stylus: [probe_shank] of machine.toml and [probe_spindle.shank] of world.toml.
namespace probebox::board {

// Optional section. Call after the tools have been read, one of which carries the shank.
void readProbeShank(Section& root, Machine& machine);
// Reads it into the first tool of the spindle; optional.
void readWorldShank(Section& spindle, WorldProbeSpindle& described);

}  // namespace probebox::board
