#include "tools/gcode/macro_b.hpp"

namespace probebox::gcode {
namespace {

class Haas final : public MacroB {
 public:
  std::string_view name() const override { return "haas"; }
  std::string_view control() const override { return "Haas NGC with macros"; }
  std::string_view tried() const override { return "This dialect was not run on a control."; }
  std::vector<std::string> needs(Marks marks) const override {
    if (marks == Marks::stops) return {};
    return {"The macro option; setting 262 (DPRNT destination) on the line that is wired to the box's tape: face.",
            "G103 P1 limits the look-ahead; the empty blocks let the motion end before a line is printed."};
  }
  std::vector<std::string> head(std::string_view title) const override { return {"%", "O09010 " + comment(title)}; }
  std::vector<std::string> start(Marks, std::string_view) const override {
    return {"G17 G21 G40 G80", "G54 G90 G94 G61", "G103 P1"};
  }
  std::vector<std::string> end(Marks) const override { return {"G103", "G64", "M30", "%"}; }
  std::string tipControl(const TipControl& tip) const override {
    return tip.tool == 0 ? "G49" : "G234 H" + std::to_string(tip.tool);
  }
  std::vector<std::string> mark(const Mark& mark) const override { return printed(mark, {";", ";"}); }
};

}  // namespace

const Dialect& haas() {
  static const Haas one;
  return one;
}

}  // namespace probebox::gcode
