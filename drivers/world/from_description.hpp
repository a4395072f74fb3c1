#pragma once
#include <vector>

#include "board/describe/machine.hpp"
#include "board/describe/world.hpp"
#include "drivers/world/config.hpp"
#include "drivers/world/controller.hpp"
#include "drivers/world/fault.hpp"

namespace probebox::world {

// Converts world.toml to the configuration of World. The seed goes to World's constructor.
Config fromDescription(const board::World& description);

// Also takes the encoders' senses from machine.toml, so that the box reads the axes as its integrator described them.
Config fromDescription(const board::World& description, const board::Machine& machine);

// The faults of world.toml, whose times count from `start`.
std::vector<Fault> faultsFromDescription(const board::World& description, MonoTime start);

// Configures the matching controller, which knows the sphere's centre with an error of `error_mm`.
ControllerConfig controllerFromDescription(const board::World& description,
                                           const Vector3& error_mm = {0.12, -0.08, 0.1});

}  // namespace probebox::world
