#pragma once
#include "board/describe/machine.hpp"
#include "board/describe/section.hpp"

namespace probebox::board {

// Section [sensor_head] of machine.toml, after the tools that carry the probe.
void readSensorHead(Section& root, Machine& machine);

}  // namespace probebox::board
