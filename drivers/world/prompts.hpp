#pragma once
#include "drivers/world/box_link.hpp"

namespace probebox::world {

// Returns whether the step moves one axis alone without contact.
bool movesOneAxis(StepKind kind);
// Returns whether the stylus or the tool touches a surface in the step.
bool touches(StepKind kind);
// Returns whether a machine can follow the prompt; it does not move for others.
bool canBeFollowed(const Prompt& prompt);

}  // namespace probebox::world
