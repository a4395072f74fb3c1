#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <string_view>
#include <vector>

#include "protocol/units/outcome.hpp"

namespace probebox::interference {

using Point = std::array<double, 3>;  // mm

// One straight piece of a program's path, in the program's coordinates.
struct Move {
  std::size_t line{};  // of the file, from 1
  bool rapid{};
  Point from{}, to{};
};

// Reads the moves of a 3-axis program (ISO 6983 as LinuxCNC takes it): G0 to G3 with I and J in the plane XY, G20, G21,
// G90, G91. Arcs become chords within `tolerance_mm`. Words without motion (F, S, N, most of M) are ignored. Error,
// with the line number: a motion that is not supported, or a change to a tool other than number `tool`. The path begins
// once X, Y and Z have each been commanded: before that the position is unknown.
Outcome<std::vector<Move>> readProgram(std::string_view text, double tolerance_mm, std::uint32_t tool);

}  // namespace probebox::interference
