#pragma once
#include "board/describe/world.hpp"
#include "drivers/world/random.hpp"

namespace probebox::world {

// Truncates normal deviates, which bounds how early a stamp can be.
inline constexpr double kLargestDeviate = 6;

// Draws the delay of the stamp of an edge by the emulated kernel, ns; negative for a stamp that is too early.
double latenessNs(const board::WorldClock& clock, Random& random, bool& outlier);

}  // namespace probebox::world
