#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <string_view>
#include <vector>

#include "protocol/units/outcome.hpp"

namespace probebox::interference {

using Point = std::array<double, 3>;  // mm

using Angles = std::array<double, 3>;  // of A, B and C, degrees

// One straight piece of a program's path, in the program's coordinates. Rotary axes turn evenly on the way.
struct Move {
  std::size_t line{};  // of the file, from 1
  bool rapid{};
  Point from{}, to{};
  Angles from_deg{}, to_deg{};
};

// What a program may contain.
struct Dialect {
  double tolerance_mm{};         // within which arcs become chords
  std::uint32_t tool{};          // number of the only one that it may change to
  std::array<bool, 3> rotary{};  // which of A, B and C the cell describes
};

// Reads the moves of a program (ISO 6983 as LinuxCNC takes it): G0 to G3 with I and J in the plane XY, G20, G21, G90,
// G91, and words A, B, C in straight moves. Words without motion (F, S, N, most of M) are ignored. Error, with the line
// number: a motion that is not supported. The path begins once X, Y and Z have each been commanded: before that the
// position is unknown. Rotary axes are at 0 until they are commanded.
Outcome<std::vector<Move>> readProgram(std::string_view text, const Dialect& dialect);

}  // namespace probebox::interference
