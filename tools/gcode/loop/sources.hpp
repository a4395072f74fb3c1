#pragma once
#include <array>
#include <string_view>

namespace probebox::gcode::loop {

// The texts of the subprograms in the language of LinuxCNC: those of the kit, and those that stand in for its HAL
// component.
extern const std::array<std::string_view, 9> kSources;

}  // namespace probebox::gcode::loop
