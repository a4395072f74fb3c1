#pragma once
#include <memory>

#include "tools/gcode/loop/writer.hpp"

namespace probebox::gcode::loop {

// Fanuc custom macro B. The PMC answers for one word at a time over a pair of 32-bit interface signals.
std::unique_ptr<Writer> fanucWriter(Axes axes);

}  // namespace probebox::gcode::loop
