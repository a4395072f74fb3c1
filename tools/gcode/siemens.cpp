#include "tools/gcode/dialect.hpp"

namespace probebox::gcode {
namespace {

class Siemens : public Dialect {
 public:
  std::string_view name() const override { return "siemens"; }
  std::string_view control() const override { return "Siemens 840D sl"; }
  std::string_view tried() const override { return "This dialect was not run on a control."; }
  std::string_view leaves() const override {
    return "programmed shifts, rotations, scales and mirrors cancelled (TRANS), G54, G90, G94, G64. After an alarm: "
           "what "
           "reset makes of G functions (MD 20150), and D.";
  }
  Lines needs(Marks marks) const override {
    constexpr const char* kPlane = "No swivelled plane: CYCLE800 is deselected.";
    if (marks == Marks::stops) return {kPlane};
    return {kPlane, "EXTOPEN and WRITE to /dev/v24, the RS-232 line that is wired to the box's tape: face.",
            "STOPRE before each WRITE ends the look-ahead. PB_ERR other than 0 stops the program."};
  }
  Lines guardNeeds() const override { return {"The probe on measuring input 1."}; }
  std::string_view guardWord() const override { return "MEAS=1"; }
  bool hasTipControl() const override { return true; }
  bool guardsUnderTipControl() const override { return true; }

  Lines head(std::string_view title, std::uint32_t) const override {
    return {"%_N_PROBEBOX_MPF", comment(title), "DEF INT PB_ERR"};
  }
  // TRANS alone cancels programmed shifts, rotations, scales and mirrors.
  Lines modes() const override { return {"G17 G710 G40", "G54 G90 G94 G60", "TRANS"}; }
  Lines start(Marks marks, std::string_view) const override {
    Lines lines = modes();
    lines.insert(lines.end(), {"M5", "M9"});
    if (marks == Marks::lines) {
      lines.emplace_back("EXTOPEN(PB_ERR,\"/dev/v24\",\"SYN\",\"EXCL\",\"APP\")");
      addCheck(lines);
    }
    return lines;
  }
  Lines end(Marks marks) const override {
    Lines lines;
    if (marks == Marks::lines) lines.emplace_back("EXTCLOSE(PB_ERR,\"/dev/v24\")");
    lines.insert(lines.end(), {"G64", "M30", "PB_TOUCHED:", "SETAL(65002,\"TOUCHED ON THE WAY\")", "M30",
                               "PB_NOTHING:", "SETAL(65003,\"NOTHING TOUCHED\")", "M30"});
    return lines;
  }
  std::string comment(std::string_view text) const override { return "; " + plain(text); }
  std::string orient(double angle_deg) const override { return "SPOS=" + decimal(angle_deg); }
  Lines guarded(const Move& move) const override { return watched(Dialect::move(move), 1, "PB_TOUCHED"); }
  Lines seek(const Move& move) const override { return watched(Dialect::move(move), 0, "PB_NOTHING"); }
  Lines guardedTurn(const Turn& turn, const Words& words) const override {
    Lines lines = this->turn(turn, words);
    const std::string last = lines.back();
    if (!last.starts_with("G1 ")) return lines;
    lines.pop_back();
    const Lines with_check = watched(last, 1, "PB_TOUCHED");
    lines.insert(lines.end(), with_check.begin(), with_check.end());
    return lines;
  }
  Lines takeLength(const Move& move) const override {
    Lines lines{"D1"};
    const Lines check = checkLength();
    lines.insert(lines.end(), check.begin(), check.end());
    if (move.length->tip_control) lines.emplace_back("TRAORI");
    lines.push_back(Dialect::move(move));
    return lines;
  }
  Lines retract(const Retract& retract, double machine_z_mm) const override {
    Lines lines;
    if (retract.tip_control) lines.emplace_back("TRAFOOF");
    lines.push_back("G0 SUPA Z" + decimal(machine_z_mm) + " D0");
    return lines;
  }
  Lines take(const TakeTool& tool) const override { return {"T" + std::to_string(tool.number), "M6"}; }
  Lines checkLength() const override {
    return {"STOPRE", "IF ($P_TOOL==0) OR ($P_TOOLL[1]==0)", "SETAL(65001,\"NO LENGTH OFFSET ACTIVE\")", "ENDIF"};
  }
  std::string wait(double s) const override { return "G4 F" + decimal(s); }
  Lines stop(const Stop& stop) const override { return {"MSG(\"" + plain(stop.text) + "\")", "M0", "MSG()"}; }
  Lines mark(const Mark& mark) const override {
    const auto& [a, b, c] = mark.angles_deg;
    Lines lines{"STOPRE", "WRITE(PB_ERR,\"/dev/v24\",\"" + nameOf(mark) + std::to_string(mark.step) + " A" +
                              decimal(a) + " B" + decimal(b) + " C" + decimal(c) + " T" + std::to_string(mark.tool) +
                              " F" + decimal(mark.speed_mm_s) + "\")"};
    addCheck(lines);
    return lines;
  }

 private:
  std::string_view lathe() const override { return "DIAMOF, G95 of a lathe (--dialect siemens-lathe)"; }
  static Lines watched(const std::string& block, int alarm_at, const std::string& label) {
    return {"MEAS=1 " + block, "STOPRE", "IF $AC_MEA[1]==" + std::to_string(alarm_at) + " GOTOF " + label};
  }
  // A block each: an alarm behind IF in its own block is no language of this control.
  static void addCheck(Lines& lines) { lines.insert(lines.end(), {"IF PB_ERR<>0", "SETAL(65000)", "ENDIF"}); }
};

// X in radius by DIAMOF; T turns the turret, without an M6.
class SiemensLathe final : public Siemens {
 public:
  std::string_view name() const override { return "siemens-lathe"; }
  bool isLathe() const override { return true; }
  std::string machines() const override {
    return "For lathes of X and Z, in the plane G18: X is in radius from DIAMOF on. T turns the turret without an M6: "
           "MD 22550 TOOL_CHANGE_MODE is 0.";
  }
  std::string_view leaves() const override {
    return "programmed shifts, rotations, scales and mirrors cancelled (TRANS), G54, G90, G94, G64. At M30 and after "
           "an alarm reset makes DIAMON, other G functions and D what the machine has for it (MD 20150).";
  }
  Lines needs(Marks marks) const override {
    Lines lines = Siemens::needs(marks);
    lines.emplace_back(
        "Where C turns: the main spindle is axis C before the start, as the builder switches it, its brake released.");
    return lines;
  }
  bool hasTipControl() const override { return false; }
  Lines modes() const override { return {"G18 G710 G40", "G54 G90 G94 G60", "TRANS", "DIAMOF"}; }
  // With its offset, which X has too: a turning tool has its lengths along X and Z.
  Lines take(const TakeTool& tool) const override { return {"T" + std::to_string(tool.number), "D1"}; }
  Lines takeLength(const Move& move) const override {
    Lines lines = checkLength();
    lines.push_back(Dialect::move(move));
    return lines;
  }
  Lines checkLength() const override {
    return {"STOPRE", "IF ($P_TOOL==0) OR (($P_TOOLL[1]==0) AND ($P_TOOLL[2]==0))",
            "SETAL(65001,\"NO TOOL OFFSET ACTIVE\")", "ENDIF"};
  }
};

}  // namespace

const Dialect& siemens() {
  static const Siemens one;
  return one;
}

const Dialect& siemensLathe() {
  static const SiemensLathe one;
  return one;
}

}  // namespace probebox::gcode
