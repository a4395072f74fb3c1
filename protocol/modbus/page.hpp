#pragma once
#include <span>
#include <string>
#include <string_view>

#include "protocol/modbus/register.hpp"

namespace probebox::modbus {

// One value of register "calibration method".
struct MethodNumber {
  unsigned number{};
  std::string_view name;
};

// The text of protocol/MODBUS.md: the reference page of the register map, in Markdown.
std::string referencePage(std::span<const MethodNumber> methods);

// The text of protocol/map.json: the same for programs, with the name of a HAL pin for each register.
std::string mapAsJson(std::span<const MethodNumber> methods);

// "X correction" in nm is "probebox.x-correction-nm": one pin for each representation.
std::string halPinOf(const Register& entry);

}  // namespace probebox::modbus
