#pragma once
#include "board/describe/machine.hpp"
#include "board/describe/section.hpp"
#include "board/describe/world.hpp"

namespace probebox::board {

// Section [sensor_head] of machine.toml, after the tools that carry the probe.
void readSensorHead(Section& root, Machine& machine);
// Section [sensor_head] of world.toml, after all other tools.
void readWorldHead(Section& root, World& world);

}  // namespace probebox::board
