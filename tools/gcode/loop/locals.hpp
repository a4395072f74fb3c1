#pragma once
#include <cstddef>
#include <map>
#include <string>
#include <vector>

#include "tools/gcode/loop/program_text.hpp"

namespace probebox::gcode::loop {

// Places of the variables that belong to one subprogram ("run/bad", "run/1"), from 0. Those of subprograms that are
// never active at the same time share places, for a control that has few. No subprogram calls itself.
std::map<std::string, std::size_t> placesOfLocals(const std::vector<Subprogram>& subprograms);

}  // namespace probebox::gcode::loop
