#pragma once
#include <optional>
#include <string>

#include "protocol/units/outcome.hpp"
#include "tools/gcode/block.hpp"
#include "tools/gcode/dialect.hpp"
#include "tools/gcode/setting.hpp"

namespace probebox::gcode {

struct Heading {
  std::string method;
  std::string command;         // command that starts the run on the box, with its options
  std::string zero;            // required position of the work offset's zero
  std::string device{};        // line to the box, for dialects whose programs name it; empty: the usual one
  std::uint32_t number{1000};  // of the program, where the control has one
};

// Refuses a head that swivels under tip control where the control's skip input cannot stop it, unless none stops
// anything (--no-skip).
std::optional<Error> whySwivelsUnguarded(const Blocks& blocks, const Setting& setting, const Dialect& dialect);

// Writes the whole program: its requirements as comments, a dry run above the part, a stop, then the run.
std::string program(const Blocks& blocks, const Setting& setting, const Heading& heading, const Dialect& dialect,
                    Marks marks);

}  // namespace probebox::gcode
