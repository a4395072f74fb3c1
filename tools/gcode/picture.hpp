#pragma once
#include <string>
#include <string_view>

#include "tools/gcode/block.hpp"
#include "tools/gcode/setting.hpp"

namespace probebox::gcode {

// Draws the path as SVG from above (X, Y) and from the front (X, Z), at one scale, including the dry run.
std::string picture(const Blocks& blocks, const Setting& setting, std::string_view title);

}  // namespace probebox::gcode
