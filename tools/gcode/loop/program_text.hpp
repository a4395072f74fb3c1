#pragma once
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "protocol/units/outcome.hpp"

// The loop program as data. It is written once, in the language of LinuxCNC (tools/linuxcnc/*.ngc); controls that read
// registers themselves get it in their own.
namespace probebox::gcode::loop {

// A value: a number, a variable, a place in a table (`#[1200 + #<tool>]`), a register by the name of its HAL pin, a
// function or an operation of its arguments.
struct Value {
  enum class Is { number, variable, table, pin, call, operation };
  Is is{};
  double number{};
  std::string name{};  // "run/axis" for a variable of a subprogram, "_pb_x" for one of all; "ABS"; "+", "EQ", "AND"
  std::vector<Value> arguments{};
};

struct Word {
  char letter{};
  Value value;
};

struct Statement {
  enum class Is { comment, message, abort, assign, call, choice, repeat, leave, give, block };
  Is is{};
  std::string text{};           // of a comment or message; the subprogram that is called
  std::vector<Value> values{};  // assign: target and value; call: arguments; choice, repeat: conditions; give: value
  std::vector<std::vector<Statement>> bodies{};  // choice: one for each condition, and the last one without
  std::vector<Word> words{};
};

struct Subprogram {
  std::string name;  // without the prefix that all have
  std::vector<Statement> body;
};

// The subprograms of sources in the language of LinuxCNC, in this order. Refuses what is beyond the subset, with its
// line.
Outcome<std::vector<Subprogram>> subprogramsOf(std::string_view source);

}  // namespace probebox::gcode::loop
