#pragma once
#include <optional>
#include <string>
#include <string_view>

#include "protocol/units/outcome.hpp"

namespace probebox::gcode::loop {

// The loop program for a control that reads registers: the box states each step, the control moves. One program for all
// methods. dialect: fanuc, siemens, or one of the two for lathes. axes: letters as the control numbers its axes, such
// as "XYZABC" or "XZC"; empty: those. Refuses dialects whose controls cannot read registers, and axes that such a
// machine cannot have, with the remedy. number: of the first program, where the control numbers them.
inline constexpr int kFirstProgram = 8700, kLastFirstProgram = 8950;
// frame: work offset of a Fanuc that the program moves in, G54.1 P1 to P48; 0: G59. By default P48, and on a lathe G59,
// which every one has.
Outcome<std::string> loopProgram(std::string_view dialect, const std::string& axes, int number = kFirstProgram,
                                 std::optional<int> frame = std::nullopt);

}  // namespace probebox::gcode::loop
