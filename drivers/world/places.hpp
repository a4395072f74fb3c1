#pragma once
#include <cstdint>

#include "drivers/world/box_link.hpp"
#include "drivers/world/controller_config.hpp"
#include "drivers/world/machine.hpp"
#include "drivers/world/route.hpp"

// Computes the machine positions of the steps that the box asks for, from the knowledge of the controller's program.
namespace probebox::world {

// Returns the machine position of a feature, with that tool in the spindle and the axes in that pose.
Place placeOf(const ControllerConfig& config, const Prompt& step, std::uint32_t tool, const Pose& pose);
// Returns a height at which the way is free, with that tool in the spindle and the axes in that pose.
double freeHeight(const ControllerConfig& config, std::uint32_t tool, const Pose& pose);

}  // namespace probebox::world
