#pragma once
#include <string_view>
#include <vector>

#include "protocol/units/outcome.hpp"
#include "tools/interference/motion.hpp"

namespace probebox::interference {

// Reads the moves of a program (ISO 6983 as LinuxCNC, Fanuc, Haas and Siemens take it). What changes no path is passed
// over; what changes it is followed or refused; a word that no code takes is refused. The path begins once X, Y and Z
// have each been commanded: before that the position is unknown. Rotary axes are at 0 until they are commanded.
Outcome<std::vector<Move>, Refusal> readProgram(std::string_view text, const Dialect& dialect);

}  // namespace probebox::interference
