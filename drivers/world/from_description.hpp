#pragma once
#include "board/describe/machine.hpp"
#include "board/describe/world.hpp"
#include "drivers/world/config.hpp"
#include "drivers/world/controller.hpp"

namespace probebox::world {

// The world of world.toml. Its seed is for World's constructor.
Config fromDescription(const board::World& description);

// The same with the encoders' senses of machine.toml: the box has to see the axes as its integrator described them.
Config fromDescription(const board::World& description, const board::Machine& machine);

// The controller that goes with it; it knows the sphere's centre up to `error_mm`.
ControllerConfig controllerFromDescription(const board::World& description,
                                           const Vector3& error_mm = {0.12, -0.08, 0.1});

}  // namespace probebox::world
