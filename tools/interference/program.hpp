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
// G90, G91; arcs become chords that are off by `tolerance_mm` at most. Words that move nothing (F, S, N, most of M) are
// passed over. Error: a line that would move the tool in a way that is not understood, or take another tool than number
// `tool`, by its number. The path begins where X, Y and Z have each been commanded: before, the position is unknown.
Outcome<std::vector<Move>> readProgram(std::string_view text, double tolerance_mm, std::uint32_t tool);

}  // namespace probebox::interference
