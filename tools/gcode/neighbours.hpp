#pragma once
#include <optional>

#include "firmware/procedure/plan/step.hpp"
#include "protocol/units/outcome.hpp"
#include "tools/gcode/block.hpp"
#include "tools/gcode/setting.hpp"

namespace probebox::gcode {

// Refuses, with the remedy, a program whose stylus would come to a ball of the part on its way to another one.
std::optional<Error> whyThroughNeighbour(const procedure::Plan& plan, const Blocks& blocks, const Setting& setting);

}  // namespace probebox::gcode
