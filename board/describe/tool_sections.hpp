#pragma once
#include "board/describe/machine.hpp"
#include "board/describe/section.hpp"

namespace probebox::board {

// Sections [[holder]] and [[tool]] of machine.toml.
void readTools(Section& root, Machine& machine);
// Section [tool_setter] of machine.toml.
void readToolSetter(Section& root, Machine& machine);

}  // namespace probebox::board
