#pragma once
#include <cstdint>
#include <string>
#include <string_view>

#include "tools/interference/motion.hpp"

namespace probebox::interference {

// Of codes in one group a block has one. `once` acts in its own block, the others until another of their group.
enum class Group : std::uint8_t {
  quiet,
  motion,
  cycle_off,
  plane,
  unit,
  distance,
  arc_middle,
  length,
  zero,
  cycle_end,
  once
};

enum class Does : std::uint8_t {
  nothing,      // that changes the path
  motion,       // value: Motion
  cycle,        // a canned cycle
  no_cycle,     // G80
  plane,        // value: the axis across it
  unit,         // value: mm
  distance,     // value: 1 for increments
  arc_middle,   // value: 1 for absolute places
  length_on,    // with H
  length_off,   //
  zero,         // value: number of the coordinate system
  cycle_end,    // value: 1 for R
  dwell,        //
  home,         // to the reference point, by way of a place
  machine,      // places in machine coordinates
  set_zero,     // G10
  shift,        // G52
  set_place,    // G92
  unset_place,  // G92.1
  probe,        // G31
};

enum class Motion : std::uint8_t { none, rapid, feed, clockwise, counterclockwise, probe };

struct Code {
  int tenths{};  // 382 for G38.2
  Group group{};
  Does does{};
  double value{};
  std::string_view words;  // that it takes beside axes, and that change no path
};

// Error: a code that would change the path otherwise, or that nobody knows here.
Outcome<Code, Refusal> codeOf(double g, bool siemens, std::size_t line);

// Letters that an M code takes. Error: one that goes on in another program, or changes how blocks are read.
Outcome<std::string_view, Refusal> wordsOfM(double m, std::size_t line);

}  // namespace probebox::interference
