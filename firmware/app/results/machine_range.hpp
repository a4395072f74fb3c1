#pragma once
#include <array>
#include <optional>

#include "board/describe/machine.hpp"
#include "firmware/corrections/travel.hpp"
#include "firmware/metrology/dataset/result.hpp"
#include "protocol/events/event.hpp"
#include "protocol/units/outcome.hpp"

// What lies within the machine that machine.toml describes.
namespace probebox::app {

using MachineTravel = std::array<corrections::Travel, kLinearAxes>;
MachineTravel travelOf(const board::Machine& machine);

// Say why an axis cannot stand where it is said to be homed; nothing when it can.
std::optional<Error> whyOutside(const AxisHomed& homed, const MachineTravel& travel);

// Say which value of a result no machine can have (metrology::refuseImplausible), or this one cannot: a length beyond
// what its axes and the longest tool reach, or a turning axis more than a travel beyond an end. Nothing when all is
// well.
std::optional<Error> whyOutside(const metrology::Result& result, const MachineTravel& travel);

}  // namespace probebox::app
