#include "tools/gcode/macro_b.hpp"

namespace probebox::gcode {
namespace {

class Fanuc final : public MacroB {
 public:
  std::string_view name() const override { return "fanuc"; }
  std::string_view control() const override { return "Fanuc 0i to 31i with custom macro B"; }
  std::string_view lathe() const override { return "G-code system A"; }
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
            "#5061 to #5063 are compared with the end of the block. #8 is how far they are from it in Z."};
  }
  Lines head(std::string_view title, std::uint32_t number) const override {
    return {"%", "O" + std::to_string(number) + " " + comment(title)};
  }
  Lines modes() const override { return {"G17 G21 G40 G80", "G54 G90 G94 G61"}; }
  // Scaling, mirror image and rotation are options: their cancelling codes are no language of a control without them.
  Lines start(Marks marks, std::string_view) const override {
    Lines lines = modes();
    lines.insert(lines.end(), {"M5", "M9", "IF[FIX[#4011]EQ51]THEN#3000=2(CANCEL SCALING G50)",
                               "IF[FIX[#4016]EQ68]THEN#3000=2(CANCEL ROTATION G69)",
                               "IF[FIX[#4022]EQ51]THEN#3000=2(CANCEL MIRROR G50.1)"});
    const Lines clear = cleared();
    lines.insert(lines.end(), clear.begin(), clear.end());
    if (marks == Marks::lines) lines.emplace_back("POPEN");
    return lines;
  }
  Lines end(Marks marks) const override {
    if (marks == Marks::stops) return {"G64", "M30", "%"};
    return {"PCLOS", "G64", "M30", "%"};
  }
  // Skip positions may include the length offset: what they differ by is seen at a standstill.
  Lines atHeight(double z_mm) const override { return {"G4 P300", "G53", "#8=#5043-[" + decimal(z_mm) + "]"}; }
  Lines guarded(const Move& move) const override { return skipped(move, "IF[#7GT0.1]THEN#3000=3(TOUCHED ON THE WAY)"); }
  Lines seek(const Move& move) const override { return skipped(move, "IF[#7LT0.02]THEN#3000=4(NOTHING TOUCHED)"); }
  Lines mark(const Mark& mark) const override { return printed(mark, {"G53"}); }

 private:
  // #7: how far the skip ended the block before its end.
  static Lines skipped(const Move& move, const std::string& alarm) {
    const auto off = [](int variable, double mm) {
      return "ABS[#" + std::to_string(variable) + "-[" + decimal(mm) + "]";
    };
    return {"G31" + placeWords(move) + " F" + decimal(move.feed_mm_min),
            "#7=" + off(5061, move.to_mm.x()) + "]+" + off(5062, move.to_mm.y()) + "]+" + off(5063, move.to_mm.z()) +
                "-#8]",
            alarm};
  }
  std::string_view tipControl() const override { return "G43.4"; }
};

}  // namespace

const Dialect& fanuc() {
  static const Fanuc one;
  return one;
}

}  // namespace probebox::gcode
