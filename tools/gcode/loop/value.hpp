#pragma once
#include <string>
#include <vector>

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

}  // namespace probebox::gcode::loop
