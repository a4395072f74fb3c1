#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "protocol/units/outcome.hpp"

namespace probebox::interference {

using Point = std::array<double, 3>;  // mm

using Angles = std::array<double, 3>;  // of A, B and C, degrees

// Z of a place above everything, such as the reference point of the machine: its height is not known.
inline constexpr double kAbove_mm = 1e6;

// probe: ends where the cutter touches, and that touch is no hit.
enum class Way : std::uint8_t { rapid, feed, probe };

// One block's motion, or one piece of a canned cycle, in the program's coordinates. Rotary axes turn evenly on the way.
struct Move {
  std::size_t line{};    // of the file, from 1
  std::uint32_t tool{};  // that makes it
  Way way{};
  Point from{}, to{};
  Angles from_deg{}, to_deg{};
  std::array<bool, 3> absolute{};  // axes whose end does not depend on where the move begins
  std::uint8_t normal{2};          // axis across the plane of an arc: 2 is G17
  double turn_rad{};  // of an arc, counterclockwise seen from the positive end of `normal`; 0: a straight line
  std::array<double, 2> middle{};  // of the arc, on the two axes that follow `normal`
};

// The place at a part (0 to 1) of the way: on a line, a helix, or a spiral whose radius changes evenly.
Point placeOn(const Move& move, double part);
// An upper bound, exact for lines, arcs and helices.
double lengthOf(const Move& move);
// A rapid where each axis runs at full speed until it is there: all start together at equal speeds and end one after
// the other. Empty where this is the straight line.
std::vector<Move> dogLeg(const Move& move);

// What a program may contain.
struct Dialect {
  std::uint32_t tool{};              // in the spindle until the program takes another
  std::vector<std::uint32_t> tools;  // that the cell describes
  std::array<bool, 3> rotary{};      // which of A, B and C the cell describes
  Point zero_mm{};                   // machine coordinates of the program's zero
};

// Why a program is not read. The name is stable; the sentence has the remedy.
struct Refusal {
  std::string name;
  std::size_t line{};  // from 1; 0: of the whole program
  std::string what;

  std::string sentence() const { return line == 0 ? what : "line " + std::to_string(line) + ": " + what; }
};

}  // namespace probebox::interference
