#pragma once
#include <span>
#include <string_view>

namespace probebox::gcode::loop {

// The texts of the subprograms in the language of LinuxCNC: those of the kit, and those that stand in for its HAL
// component.
std::span<const std::string_view> sources();

}  // namespace probebox::gcode::loop
