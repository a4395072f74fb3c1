#pragma once
#include <string>

namespace probebox::modbus {

// The text of protocol/MODBUS.md: the reference page of the register map, in Markdown.
std::string referencePage();

}  // namespace probebox::modbus
