#include "tools/gcode/macro_b.hpp"

#include <array>
#include <cmath>

namespace probebox::gcode {

Dialect::Lines MacroB::retract(const Retract&, double machine_z_mm) const {
  return {"G0 G90 G49 G53 Z" + decimal(machine_z_mm)};
}

Dialect::Lines MacroB::takeLength(const Move& move) const {
  const std::string code{move.length->tip_control ? tipControl() : "G43"};
  return {"G1 " + code + " H" + std::to_string(move.length->tool) + placeWords(move) + " F" +
          decimal(move.feed_mm_min)};
}

// #4012: modal macro; #4017: polar words. Machine less work position, external shift and G54 is the shift of G92, which
// no code cancels on every control.
Dialect::Lines MacroB::cleared() const {
  Lines lines{"G52 X0 Y0 Z0", "IF[FIX[#4012]EQ66]THEN#3000=2(MODAL MACRO ON: G67)",
              "IF[FIX[#4017]EQ16]THEN#3000=2(POLAR WORDS ON: G15)"};
  for (const char axis : {'1', '2'}) {
    const std::string n{axis};
    lines.push_back("IF[ABS[#502" + n + "-#504" + n + "-#520" + n + "-#522" + n +
                    "]GT0.01]THEN#3000=2(CANCEL SHIFT OF G92)");
  }
  return lines;
}

// #4008: code of the length offset, which G44 would subtract; #4111: number of the offset.
Dialect::Lines MacroB::checkLength() const {
  return {"IF[#4008NE43]THEN#3000=1(NO LENGTH OFFSET ACTIVE)", "IF[#4111EQ0]THEN#3000=1(NO LENGTH OFFSET ACTIVE)"};
}

std::string MacroB::wait(double s) const {
  return "G4 P" + std::to_string(std::lround(s * 1000));
}

Dialect::Lines MacroB::stop(const Stop& stop) const {
  return {comment(stop.text), "#3006=1(" + plain(stop.message) + ")"};
}

Dialect::Lines MacroB::printed(const Mark& mark, const Lines& first) const {
  const auto& [a, b, c] = mark.angles_deg;
  Lines lines = first;
  lines.push_back("#1=" + std::to_string(mark.step));
  lines.push_back("#2=" + decimal(a));
  lines.push_back("#3=" + decimal(b));
  lines.push_back("#4=" + decimal(c));
  lines.push_back("#5=" + std::to_string(mark.tool));
  lines.push_back("#6=" + decimal(mark.speed_mm_s));
  lines.push_back("DPRNT[" + nameOf(mark) + "#1[40]*A#2[43]*B#3[43]*C#4[43]*T#5[40]*F#6[43]]");
  return lines;
}

}  // namespace probebox::gcode
