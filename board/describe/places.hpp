#pragma once
#include <array>
#include <cstddef>
#include <string_view>

#include "board/describe/machine.hpp"
#include "board/describe/section.hpp"

// Checks positions of machine.toml against the travel of its axes, which must have been read before. Private to the
// room.
namespace probebox::board {

// Reports a position on one linear axis (0 X, 1 Y, 2 Z) that the axis cannot reach.
void requireReachable(Section& section, std::string_view key, double position_mm, std::size_t axis,
                      const Machine& machine);
// Reports such positions on X, Y and Z.
void requireReachable(Section& section, std::string_view key, const std::array<double, 3>& position_mm,
                      const Machine& machine);

// Reports a coordinate of a turning axis that is farther outside the travel than the travel is long. Less is allowed: a
// large chuck may turn about a point that the stylus does not reach.
void requireNear(Section& section, std::string_view key, double position_mm, std::size_t axis, const Machine& machine);

}  // namespace probebox::board
