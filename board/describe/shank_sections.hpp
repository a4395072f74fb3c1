#pragma once
#include "board/describe/machine.hpp"
#include "board/describe/section.hpp"

// Reads the shank of the stylus: [probe_shank] of machine.toml and [probe_spindle.shank] of world.toml.
namespace probebox::board {

// Optional section. Call after the tools have been read, one of which carries the shank.
void readProbeShank(Section& root, Machine& machine);
// Requires the upper end of a shank above its lower one.
void checkEnds(Section& section, double from_mm, double to_mm);

}  // namespace probebox::board
