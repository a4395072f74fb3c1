#pragma once
#include <map>
#include <string>
#include <vector>

#include "control.hpp"
#include "tools/gcode/loop/program_text.hpp"

namespace probebox::scenario {

// Runs the loop program of the LinuxCNC kit itself: its subprograms as they are, and its HAL component's part by
// registers.
class Kit {
 public:
  explicit Kit(Control& control);

  // Calls a subprogram with arguments; its value.
  double call(const std::string& name, const std::vector<double>& arguments);
  // Of a place of the tables: from the next call on whatever probebox_places.ngc says.
  void setTable(int number, double value) { preset_[number] = value; }
  std::map<std::string, double> variables;  // as gcode::loop names them

 private:
  enum class Left { no, loop, subprogram };
  Left body(const std::vector<gcode::loop::Statement>& statements);
  Left statement(const gcode::loop::Statement& one);
  Left choice(const gcode::loop::Statement& one);
  void block(const gcode::loop::Statement& one);
  double value(const gcode::loop::Value& of);
  double operation(const gcode::loop::Value& of);
  double pin(const std::string& name);
  double& place(const gcode::loop::Value& of);

  // As probebox_master does it.
  double ask(const std::vector<double>& what);
  double mark(int phase);
  // chosen: as a program asks for a start.
  double controller_request(double what, double of, const std::vector<double>& chosen);
  void look();

  Control& control_;
  std::map<std::string, gcode::loop::Subprogram> subprograms_;
  std::map<std::string, double> step_;
  std::map<int, double> tables_, preset_;
  bool pressing_{};
};

}  // namespace probebox::scenario
