#pragma once
#include <array>
#include <span>
#include <vector>

#include "protocol/modbus/register.hpp"

// The parts that registers() puts together, by rising address.
namespace probebox::modbus {

std::span<const Register> procedureRegisters();

// Those of resultBlocks() and toolTables().
std::vector<Register> resultRegisters();

}  // namespace probebox::modbus
