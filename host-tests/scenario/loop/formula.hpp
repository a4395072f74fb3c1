#pragma once
#include <functional>
#include <string>
#include <string_view>

namespace probebox::scenario {

// Values of the texts of Fanuc and Siemens: numbers, + - * /, brackets of both kinds, functions, and what the control
// knows.
class Formula {
 public:
  // Names: "#" with the number of a Fanuc variable, or "PB_X"; index 0 without one.
  using Known = std::function<double(const std::string& name, double index)>;

  Formula(std::string_view text, const Known& known) : rest_{text}, known_{known} {}
  // Of the whole text. Throws Alarm where it cannot be read.
  double value();

 private:
  double sum();
  double product();
  double primary();
  double named();
  double inBrackets(char closing);
  bool take(std::string_view text);
  void skip();

  std::string_view rest_;
  const Known& known_;
};

// "a < b" in the words of either control.
bool holds(std::string_view condition, const Formula::Known& known);

}  // namespace probebox::scenario
