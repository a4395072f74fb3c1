#pragma once
#include "drivers/world/config.hpp"
#include "drivers/world/random.hpp"

namespace probebox::world {

// Beyond this a normal deviate is not believed, so that a stamp can be too early by so much and no more.
inline constexpr double kLargestDeviate = 6;

// How much later than it happened the emulated kernel stamps an edge, ns; below 0 for one that it stamps too early.
double latenessNs(const SyncConfig& config, Random& random, bool& outlier);

}  // namespace probebox::world
