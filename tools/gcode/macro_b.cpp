#include "tools/gcode/macro_b.hpp"

#include <array>
#include <cmath>

namespace probebox::gcode {

std::string MacroB::wait(double s) const {
  return "G4 P" + std::to_string(std::lround(s * 1000));
}

std::vector<std::string> MacroB::printed(const Mark& mark, const std::vector<std::string>& first) const {
  const auto& [a, b, c] = mark.angles_deg;
  std::vector<std::string> lines = first;
  lines.push_back("#101=" + std::to_string(mark.step));
  lines.push_back("#102=" + decimal(a));
  lines.push_back("#103=" + decimal(b));
  lines.push_back("#104=" + decimal(c));
  lines.push_back("#105=" + std::to_string(mark.tool));
  lines.push_back("#106=" + decimal(mark.speed_mm_s));
  lines.push_back("DPRNT[" + nameOf(mark) + "#101[40]*A#102[43]*B#103[43]*C#104[43]*T#105[40]*F#106[43]]");
  return lines;
}

}  // namespace probebox::gcode
