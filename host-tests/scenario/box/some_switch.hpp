#pragma once
#include "drivers/world/config.hpp"
#include "drivers/world/random.hpp"

namespace probebox::scenario {

// The switch of a touch-trigger probe with some pre-travel, late by some time, that chatters.
inline world::TouchTriggerConfig someSwitch(world::Random& random) {
  return {.fitted = true,
          .pre_travel_mm = random.uniform(0.005, 0.015),
          .lobe_mm = random.uniform(-0.004, 0.004),
          .axial_mm = random.uniform(0.001, 0.006),
          .hysteresis_mm = 0.0002,
          .repeatability_um = 0.4,
          .late_s = random.uniform(0.0002, 0.002),
          .chatter_probability = 0.2,
          .chatter_s = 0.0008};
}

}  // namespace probebox::scenario
