#pragma once
#include <array>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "protocol/modbus/register.hpp"

// The parts from which registers() is assembled, by rising address.
namespace probebox::modbus {

// Returns the axes in a name of the tables below, "XYZ" or "ABC": such a row defines three entries, one for each axis,
// in successive registers. Empty for a row that defines one entry.
constexpr std::string_view axesIn(std::string_view name) {
  for (const std::string_view axes : {"XYZ", "ABC"})
    if (name.find(axes) != std::string_view::npos) return axes;
  return {};
}

// Keeps a text for as long as the program runs: registers refer to it.
std::string_view kept(std::string text);

std::span<const Register> procedureRegisters();

// The registers of resultBlocks() and toolTables().
std::vector<Register> resultRegisters();

}  // namespace probebox::modbus
