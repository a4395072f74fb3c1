#include "tools/gcode/dialect.hpp"

namespace probebox::gcode {
namespace {

class Siemens final : public Dialect {
 public:
  std::string_view name() const override { return "siemens"; }
  std::string_view control() const override { return "Siemens 840D sl"; }
  std::string_view tried() const override { return "This dialect was not run on a control."; }
  std::vector<std::string> needs(Marks marks) const override {
    if (marks == Marks::stops) return {};
    return {"EXTOPEN and WRITE to /dev/v24, the RS-232 line that is wired to the box's tape: face.",
            "STOPRE before each WRITE ends the look-ahead. PB_ERR other than 0 stops the program."};
  }
  std::vector<std::string> head(std::string_view title) const override {
    return {"%_N_PROBEBOX_MPF", comment(title), "DEF INT PB_ERR"};
  }
  std::vector<std::string> start(Marks marks, std::string_view) const override {
    std::vector<std::string> lines{"G17 G71 G40", "G54 G90 G94 G60"};
    if (marks == Marks::lines) {
      lines.emplace_back("EXTOPEN(PB_ERR,\"/dev/v24\",\"SYN\",\"EXCL\",\"APP\")");
      addCheck(lines);
    }
    return lines;
  }
  std::vector<std::string> end(Marks marks) const override {
    if (marks == Marks::stops) return {"G64", "M30"};
    return {"EXTCLOSE(PB_ERR,\"/dev/v24\")", "G64", "M30"};
  }
  std::string comment(std::string_view text) const override { return "; " + plain(text); }
  std::vector<std::string> take(const TakeTool& tool) const override {
    if (tool.number == 0) return {comment("THE PROBE IS IN THE SPINDLE, ITS LENGTH OFFSET ACTIVE")};
    return {"T" + std::to_string(tool.number), "M6", "D1"};
  }
  std::string tipControl(const TipControl& tip) const override { return tip.tool == 0 ? "TRAFOOF" : "TRAORI"; }
  std::string wait(double s) const override { return "G4 F" + decimal(s); }
  std::vector<std::string> stop(std::string_view text) const override {
    return {"MSG(\"" + plain(text) + "\")", "M0", "MSG()"};
  }
  std::vector<std::string> mark(const Mark& mark) const override {
    const auto& [a, b, c] = mark.angles_deg;
    std::vector<std::string> lines{"STOPRE", "WRITE(PB_ERR,\"/dev/v24\",\"" + nameOf(mark) + std::to_string(mark.step) +
                                                 " A" + decimal(a) + " B" + decimal(b) + " C" + decimal(c) + " T" +
                                                 std::to_string(mark.tool) + " F" + decimal(mark.speed_mm_s) + "\")"};
    addCheck(lines);
    return lines;
  }

 private:
  // A block each: an alarm behind IF in its own block is no language of this control.
  static void addCheck(std::vector<std::string>& lines) {
    lines.insert(lines.end(), {"IF PB_ERR<>0", "SETAL(65000)", "ENDIF"});
  }
};

}  // namespace

const Dialect& siemens() {
  static const Siemens one;
  return one;
}

}  // namespace probebox::gcode
