#pragma once
#include <string>

#include "tools/gcode/block.hpp"
#include "tools/gcode/dialect.hpp"
#include "tools/gcode/setting.hpp"

namespace probebox::gcode {

struct Heading {
  std::string method;
  std::string command;   // that starts the run on the box, with its options
  std::string zero;      // where the zero of the work offset has to be
  std::string device{};  // of the line to the box, where the program names it; empty: the usual one
};

// The whole program: what it needs, a dry run above the part, a stop, then the run itself.
std::string program(const Blocks& blocks, const Setting& setting, const Heading& heading, const Dialect& dialect,
                    Marks marks);

}  // namespace probebox::gcode
