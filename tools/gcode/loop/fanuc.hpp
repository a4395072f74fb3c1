#pragma once
#include <memory>

#include "tools/gcode/loop/writer.hpp"

namespace probebox::gcode::loop {

// Fanuc custom macro B. The PMC answers for one word at a time over a pair of 32-bit interface signals. first: number
// of the program that is called; it and the next 49 are taken. frame: of G54.1 P, which they move in; 0: G59.
std::unique_ptr<Writer> fanucWriter(Axes axes, int first, int frame);

}  // namespace probebox::gcode::loop
