#pragma once
#include <string>
#include <string_view>

#include "protocol/units/outcome.hpp"
#include "tools/gcode/loop/value.hpp"

namespace probebox::gcode::loop {

// Reads values from one line in the language of LinuxCNC.
class Reader {
 public:
  // subprogram: owner of its variables.
  Reader(std::string_view line, std::string subprogram) : rest_{line}, owner_{std::move(subprogram)} {}

  // "[...]", "#3", "#<name>", "12.5", "ABS[...]".
  Outcome<Value> value();
  bool atEnd();
  bool take(std::string_view text);  // skips spaces first
  char letter();                     // of a word; 0 for anything else
  std::string_view rest() const { return rest_; }

 private:
  Outcome<Value> operation(int level);
  Outcome<Value> number();
  Outcome<Value> parameter();
  Outcome<Value> function();
  std::string operatorOf(int level);
  void skip();

  std::string_view rest_;
  std::string owner_;
};

}  // namespace probebox::gcode::loop
