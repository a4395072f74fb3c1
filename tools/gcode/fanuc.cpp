#include <array>
#include <cstdio>

#include "tools/gcode/macro_b.hpp"

namespace probebox::gcode {
namespace {

class Fanuc : public MacroB {
 public:
  std::string_view name() const override { return "fanuc"; }
  std::string_view control() const override { return "Fanuc 0i to 31i with custom macro B"; }
  std::string_view tried() const override { return "This dialect was not run on a control."; }
  std::string_view leaves() const override {
    return "G52 at zero, G54, G90, G94, G64. After an alarm: what reset makes of modal codes (parameter 3402).";
  }
  Lines needs(Marks marks) const override {
    if (marks == Marks::stops) return {"Custom macro B. Local variables #1 to #8 are overwritten, no common ones."};
    return {
        "Custom macro B with POPEN and DPRNT, the RS-232 channel of parameter 0020 wired to the box's tape: face. "
        "Local variables #1 to #8 are overwritten, no common ones.",
        "G53 alone before each DPRNT ends the look-ahead. Where it does not, use an M code of parameters 3411 to "
        "3420."};
  }
  Lines guardNeeds() const override {
    return {"G31 obeys the feed override only where bit 7 (SKF) of parameter 6200 is 1: set it for the dry run.",
            "#" + variableOf('X', kSkipped) + " to #" + variableOf('Z', kSkipped) +
                " are compared with the end of the block. #8 is how far they are from it in Z."};
  }
  Lines head(std::string_view title, std::uint32_t number) const override {
    return {"%", "O" + std::to_string(number) + " " + comment(title)};
  }
  Lines modes() const override { return {"G17 G21 G40 G80", "G54 G90 G94 G61"}; }
  // Scaling, mirror image and rotation are options: their cancelling codes are no language of a control without them.
  Lines start(Marks marks, std::string_view) const override {
    Lines lines = modes();
    lines.insert(lines.end(), {"M5", "M9", "IF[FIX[#4011]EQ51]THEN#3000=2(CANCEL SCALING G50)"});
    for (const Lines& some : {refusals(), Lines{"IF[FIX[#4022]EQ51]THEN#3000=2(CANCEL MIRROR G50.1)"}, cleared()})
      lines.insert(lines.end(), some.begin(), some.end());
    if (marks == Marks::lines) lines.emplace_back("POPEN");
    return lines;
  }
  Lines end(Marks marks) const override {
    if (marks == Marks::stops) return {"G64", "M30", "%"};
    return {"PCLOS", "G64", "M30", "%"};
  }
  // Skip positions may include the length offset: what they differ by is seen at a standstill.
  Lines atHeight(double z_mm) const override {
    return {"G4 P300", "G53", "#8=#" + variableOf('Z', 5041) + "-[" + decimal(z_mm) + "]"};
  }
  Lines guarded(const Move& move) const override { return skipped(move, "IF[#7GT0.1]THEN#3000=3(TOUCHED ON THE WAY)"); }
  Lines seek(const Move& move) const override { return skipped(move, "IF[#7LT0.02]THEN#3000=4(NOTHING TOUCHED)"); }
  Lines mark(const Mark& mark) const override { return printed(mark, {"G53"}); }

 protected:
  // Alarms where what bends the way is active, by the modal groups of this machine.
  virtual Lines refusals() const { return {"IF[FIX[#4016]EQ68]THEN#3000=2(CANCEL ROTATION G69)"}; }

 private:
  static constexpr std::size_t kSkipped = 5061;

  std::string variableOf(char axis, std::size_t first) const { return std::to_string(first + linearAxes().find(axis)); }
  // #7: how far the skip ended the block before its end.
  Lines skipped(const Move& move, const std::string& alarm) const {
    std::string off;
    for (const char axis : linearAxes()) {
      const double mm = move.to_mm[axis - 'X'] * (axis == 'X' ? xFactor() : 1);
      off += (off.empty() ? "ABS[#" : "+ABS[#") + variableOf(axis, kSkipped) + "-[" + decimal(mm) + "]" +
             (axis == 'Z' ? "-#8]" : "]");
    }
    return {"G31" + placeWords(move) + " F" + decimal(move.feed_mm_min), "#7=" + off, alarm};
  }
  std::string_view tipControl() const override { return "G43.4"; }
  std::string_view lathe() const override { return "G-code system A (--dialect fanuc-lathe)"; }
};

// G-code system A: G90, G92 and G94 are cycles, increments are U and W, and T takes a station with its offset.
class FanucLathe final : public Fanuc {
 public:
  std::string_view name() const override { return "fanuc-lathe"; }
  std::string_view control() const override { return "Fanuc 0i-T to 31i-T with custom macro B"; }
  bool isLathe() const override { return true; }
  std::string machines() const override {
    return "For lathes of X and Z, the first and the second axis, in G-code system A. X and U are diameters: bit 3 of "
           "parameter 1006 (DIA) is 1 for X. Comments and lines to the box have radius. T has two digits for the "
           "station and two for the offset, which it takes as a shift, without a move: bit 4 of parameter 5002 (LGT) "
           "is "
           "0.";
  }
  std::string_view leaves() const override {
    return "G52 at zero, G54, G99, G64. After an alarm: what reset makes of modal codes (parameter 3402).";
  }
  Lines needs(Marks marks) const override {
    Lines lines = Fanuc::needs(marks);
    lines.emplace_back("A shift by G50 X Z of an earlier program is not seen: cancel it.");
    lines.emplace_back(
        "Where C turns: the contouring of the main spindle is on and its brake released before the start, by the M "
        "codes of the builder.");
    return lines;
  }
  bool hasTipControl() const override { return false; }
  Lines modes() const override { return {"G18 G21 G40 G80", "G54 G98 G61"}; }
  Lines end(Marks marks) const override {
    Lines lines = Fanuc::end(marks);
    lines.insert(lines.end() - 2, "G99");
    return lines;
  }
  Lines moveBy(const Eigen::Vector3d& by_mm, double feed_mm_min) const override {
    return {"G1 U" + decimal(xFactor() * by_mm.x()) + " W" + decimal(by_mm.z()) + " F" + decimal(feed_mm_min)};
  }
  // Z first: X may be above something, and nothing is at the safe height.
  Lines retract(const Retract&, double) const override { return {"G28 W0", "G28 U0"}; }
  std::string retracting(double) const override {
    return "Z, and X behind it, go to the reference point at rapid (G28), where the turret turns";
  }
  Lines take(const TakeTool& tool) const override {
    std::array<char, 16> word{};
    std::snprintf(word.data(), word.size(), "T%02u%02u", tool.number, tool.number);
    return {word.data()};
  }
  Lines takeLength(const Move& move) const override { return {Dialect::move(move)}; }
  Lines checkLength() const override { return {"IF[[#4120-100*FIX[#4120/100]]EQ0]THEN#3000=1(NO TOOL OFFSET ACTIVE)"}; }

 private:
  double xFactor() const override { return 2; }
  Lines cleared() const override { return {"G52 X0 Z0", "IF[FIX[#4012]EQ66]THEN#3000=2(MODAL MACRO ON: G67)"}; }
  Lines refusals() const override {
    return {"IF[FIX[#4017]EQ68]THEN#3000=2(CANCEL ROTATION G69.1)",
            "IF[#4004EQ68]THEN#3000=2(CANCEL TURRET MIRROR G69)",
            "IF[ABS[#4021-12.1]LT0.05]THEN#3000=2(CANCEL POLAR MODE G13.1)"};
  }
};

}  // namespace

const Dialect& fanuc() {
  static const Fanuc one;
  return one;
}

const Dialect& fanucLathe() {
  static const FanucLathe one;
  return one;
}

}  // namespace probebox::gcode
