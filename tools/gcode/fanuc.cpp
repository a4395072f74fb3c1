#include "tools/gcode/macro_b.hpp"

namespace probebox::gcode {
namespace {

class Fanuc final : public MacroB {
 public:
  std::string_view name() const override { return "fanuc"; }
  std::string_view control() const override { return "Fanuc 0i to 31i with custom macro B"; }
  std::string_view tried() const override { return "This dialect was not run on a control."; }
  std::vector<std::string> needs(Marks marks) const override {
    if (marks == Marks::stops) return {};
    return {"Custom macro B with POPEN and DPRNT; the RS-232 channel of parameter 0020 wired to the box's tape: face.",
            "G53 alone before each DPRNT ends the look-ahead. Where it does not, use an M code of parameters 3411 to "
            "3420."};
  }
  std::vector<std::string> head(std::string_view title) const override { return {"%", "O9010 " + comment(title)}; }
  std::vector<std::string> start(Marks marks, std::string_view) const override {
    std::vector<std::string> lines{"G17 G21 G40 G80", "G54 G90 G94 G61"};
    if (marks == Marks::lines) lines.emplace_back("POPEN");
    return lines;
  }
  std::vector<std::string> end(Marks marks) const override {
    if (marks == Marks::stops) return {"G64", "M30", "%"};
    return {"PCLOS", "G64", "M30", "%"};
  }
  std::string tipControl(const TipControl& tip) const override {
    return tip.tool == 0 ? "G49" : "G43.4 H" + std::to_string(tip.tool);
  }
  std::vector<std::string> mark(const Mark& mark) const override { return printed(mark, {"G53"}); }
};

}  // namespace

const Dialect& fanuc() {
  static const Fanuc one;
  return one;
}

}  // namespace probebox::gcode
