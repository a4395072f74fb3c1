#pragma once
#include <array>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "protocol/modbus/register.hpp"

// The parts that registers() puts together, by rising address.
namespace probebox::modbus {

// The axes in a name of a table below, "XYZ" or "ABC": its row stands for three, one for each of them, and the next
// registers follow. Empty where the row stands for itself.
constexpr std::string_view axesIn(std::string_view name) {
  for (const std::string_view axes : {"XYZ", "ABC"})
    if (name.find(axes) != std::string_view::npos) return axes;
  return {};
}

// Keeps a text for as long as the program runs: registers refer to it.
std::string_view kept(std::string text);

std::span<const Register> procedureRegisters();

// Those of resultBlocks() and toolTables().
std::vector<Register> resultRegisters();

}  // namespace probebox::modbus
