#pragma once
#include <optional>

#include "protocol/units/outcome.hpp"
#include "tools/gcode/block.hpp"
#include "tools/gcode/dialect.hpp"
#include "tools/gcode/setting.hpp"

namespace probebox::gcode {

// Refuses, with the remedy, a step that presses the probe for longer than the control masks it, between two exact stops
// at which the mask begins anew.
std::optional<Error> whyMaskedTooLong(const Blocks& blocks, const Setting& setting, const Dialect& dialect);

}  // namespace probebox::gcode
