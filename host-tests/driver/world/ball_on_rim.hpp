#pragma once
#include "streams.hpp"

namespace probebox::world::testing {

// A ball of 6 mm at 60 mm from C.
inline Config withABall() {
  Config config = quiet();
  config.part_spindle.point_mm = {300, 50, -40};
  config.part_spindle.balls_mm = {{0, 60, 20}};
  config.part_spindle.ball_radius_mm = 6;
  config.rotary.noise_rad = 0;
  config.axes.home_mm = {315, 110, 60};
  return config;
}

}  // namespace probebox::world::testing
