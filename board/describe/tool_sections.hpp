#pragma once
#include "board/describe/machine.hpp"
#include "board/describe/section.hpp"

namespace probebox::board {

// Sections [[holder]] and [[tool]] of machine.toml.
void readTools(Section& root, Machine& machine);
// Section [tool_setter] of machine.toml.
void readToolSetter(Section& root, Machine& machine);
// Section [sensor_head] of machine.toml, after the tools that carry the probe.
void readSensorHead(Section& root, Machine& machine);
// Section [probe_shank] of machine.toml, after the tools, one of which carries the shank.
void readProbeShank(Section& root, Machine& machine);
// Requires the upper end of a shank above its lower one.
void checkEnds(Section& section, double from_mm, double to_mm);

}  // namespace probebox::board
