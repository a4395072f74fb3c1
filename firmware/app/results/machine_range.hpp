#pragma once
#include <array>
#include <optional>

#include "board/describe/machine.hpp"
#include "firmware/corrections/travel.hpp"
#include "firmware/metrology/dataset/result.hpp"
#include "protocol/events/event.hpp"
#include "protocol/units/outcome.hpp"

// Checks values against the travels and lengths in machine.toml.
namespace probebox::app {

using MachineTravel = std::array<corrections::Travel, kLinearAxes>;
MachineTravel travelOf(const board::Machine& machine);

// Explains why an axis cannot be at the position it is said to be homed at; nothing when it can.
std::optional<Error> validateRange(const AxisHomed& homed, const MachineTravel& travel);

// Names a value of a result that no machine can have (metrology::refuseImplausible), or this one cannot: a length
// beyond the reach of its axes and longest tool, or a rotary axis more than a travel beyond an end. Nothing when all
// are possible.
std::optional<Error> validateRange(const metrology::Result& result, const MachineTravel& travel);

}  // namespace probebox::app
