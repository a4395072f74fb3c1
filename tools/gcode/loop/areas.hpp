#pragma once
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "protocol/modbus/register.hpp"

// How a PLC, or a gateway, holds registers of the box for a control that is no Modbus master.
namespace probebox::gcode::loop {

// Registers that are transferred by one request, and where they lie in the PLC.
struct Area {
  std::uint16_t first{};
  std::uint16_t count{};
  std::uint16_t word{};    // of its first register, from the beginning of all areas
  std::uint16_t commit{};  // of what is written: the register whose change sends this area; 0 for what is read
};
std::span<const Area> areasRead();
std::span<const Area> areasWritten();

struct Place {
  const modbus::Register* entry{};
  std::uint16_t word{};
};
// Where a register, named by its HAL pin, is read from and written to; nothing where no area has it.
std::optional<Place> placeRead(std::string_view pin);
std::optional<Place> placeWritten(std::string_view pin);
// "probebox.step-kind": registers of the present step, which programs read from a copy of one instant.
bool ofStep(std::string_view pin);

}  // namespace probebox::gcode::loop
