#pragma once
#include <memory>

#include "tools/gcode/loop/writer.hpp"

namespace probebox::gcode::loop {

// Fanuc custom macro B. The PMC answers for one word at a time over a pair of 32-bit interface signals. first: number
// of the program that is called; it and the next 49 are taken.
std::unique_ptr<Writer> fanucWriter(Axes axes, int first);

}  // namespace probebox::gcode::loop
