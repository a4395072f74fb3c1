#pragma once
#include <cstdint>

#include "drivers/world/box_link.hpp"
#include "drivers/world/controller_config.hpp"
#include "drivers/world/machine.hpp"
#include "drivers/world/route.hpp"

// Where the machine has to stand for what the box asks for, as far as the controller's program knows.
namespace probebox::world {

// Of a feature in machine positions, with that tool in the spindle and the axes in that pose.
Place placeOf(const ControllerConfig& config, const Prompt& step, std::uint32_t tool, const Pose& pose);
// Nothing is in the way of the machine there, however low the stylus hangs.
double freeHeight(const ControllerConfig& config, std::uint32_t tool, const Pose& pose);

}  // namespace probebox::world
