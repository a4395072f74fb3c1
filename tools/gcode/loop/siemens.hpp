#pragma once
#include <memory>

#include "tools/gcode/loop/writer.hpp"

namespace probebox::gcode::loop {

// Siemens 840D sl and ONE. The PLC keeps the registers in the memory that it shares with the NC.
std::unique_ptr<Writer> siemensWriter(Axes axes);

}  // namespace probebox::gcode::loop
