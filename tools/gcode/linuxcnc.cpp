#include "tools/gcode/dialect.hpp"

namespace probebox::gcode {
namespace {

class LinuxCnc final : public Dialect {
 public:
  std::string_view name() const override { return "linuxcnc"; }
  std::string_view control() const override { return "LinuxCNC 2.9"; }
  std::string_view tried() const override {
    return "The tests read it with LinuxCNC's own interpreter, rs274. No machine was moved by it.";
  }
  std::vector<std::string> needs(Marks marks) const override {
    if (marks == Marks::stops) return {};
    return {"The box's tape: face on the serial line that LOGAPPEND names.",
            "M66 P0 L0 before each line keeps the interpreter from running ahead of the motion."};
  }
  std::vector<std::string> head(std::string_view title) const override { return {"%", comment(title)}; }
  std::vector<std::string> start(Marks marks, std::string_view device) const override {
    std::vector<std::string> lines{"G17 G21 G40 G54 G90 G94 G61.1"};
    if (marks == Marks::lines)
      lines.push_back("(LOGAPPEND," + std::string{device.empty() ? "/dev/ttyS1" : device} + ")");
    return lines;
  }
  std::vector<std::string> end(Marks marks) const override {
    if (marks == Marks::stops) return {"M2", "%"};
    return {"(LOGCLOSE)", "M2", "%"};
  }
  std::string tipControl(const TipControl&) const override { return {}; }
  std::vector<std::string> mark(const Mark& mark) const override {
    const auto& [a, b, c] = mark.angles_deg;
    return {"M66 P0 L0", "(LOG," + nameOf(mark) + std::to_string(mark.step) + " A" + decimal(a) + " B" + decimal(b) +
                             " C" + decimal(c) + " T" + std::to_string(mark.tool) + " F" + decimal(mark.speed_mm_s) +
                             ")"};
  }
};

}  // namespace

const Dialect& linuxcnc() {
  static const LinuxCnc one;
  return one;
}

}  // namespace probebox::gcode
