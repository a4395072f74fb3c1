#pragma once
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "protocol/units/outcome.hpp"
#include "tools/gcode/loop/value.hpp"

// The loop program as data. It is written once, in the language of LinuxCNC (tools/linuxcnc/*.ngc); controls that read
// registers themselves get it in their own.
namespace probebox::gcode::loop {

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
