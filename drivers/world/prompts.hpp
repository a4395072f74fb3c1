#pragma once
#include "drivers/world/box_link.hpp"

namespace probebox::world {

// One axis alone, and nothing is touched.
bool movesOneAxis(StepKind kind);
// Its stylus, or its tool, meets a surface.
bool touches(StepKind kind);
// A prompt that a machine can follow; anything else is not moved for.
bool canBeFollowed(const Prompt& prompt);

}  // namespace probebox::world
