#pragma once
#include <cstdint>

#include "board/describe/machine.hpp"
#include "board/describe/section.hpp"
#include "board/describe/world.hpp"

namespace probebox::board {

// Checks the name of a tool or a holder.
inline constexpr Range kToolNumbers{1, 65'535};

// Sections [[holder]] and [[tool]] of machine.toml.
void readTools(Section& root, Machine& machine);
// Section [tool_setter] of machine.toml.
void readToolSetter(Section& root, Machine& machine);
// Sections [tool_setter] and [[tool]] of world.toml.
void readWorldTools(Section& root, World& world);
// Notes the number of a tool that one of the tools read so far has already.
void requireNewTool(Section& section, const World& world, std::uint32_t number);

}  // namespace probebox::board
