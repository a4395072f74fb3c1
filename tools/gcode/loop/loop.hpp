#pragma once
#include <string>
#include <string_view>

#include "protocol/units/outcome.hpp"

namespace probebox::gcode::loop {

// The loop program for a control that reads registers: the box states each step, the control moves. One program for all
// methods. dialect: fanuc or siemens. axes: letters as the control numbers its axes, such as "XYZABC". Refuses dialects
// whose controls cannot read registers, with the remedy.
// number: of the first program, where the control numbers them.
inline constexpr int kFirstProgram = 8700, kLastFirstProgram = 8950;
// frame: work offset of a Fanuc that the program moves in, G54.1 P1 to P48; 0: G59.
inline constexpr int kFrame = 48;
Outcome<std::string> loopProgram(std::string_view dialect, const std::string& axes, int number = kFirstProgram,
                                 int frame = kFrame);

}  // namespace probebox::gcode::loop
