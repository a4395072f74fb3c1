#pragma once
#include <array>
#include <numbers>

#include "drivers/world/machine.hpp"

namespace probebox::scenario {

// Axis C at the height of the first ball less that of the probe's spindle, at the stylus' own.
inline std::array<double, 2> trueCentre(const world::Config& config, const world::Machine& machine) {
  const auto& part = config.part_spindle;
  const auto tip = [&](double a_rad) { return machine.tipIn({.a_rad = a_rad}, 1); };
  std::array<double, 2> centre{};
  for (std::size_t i = 0; i < 2; ++i) {
    const double lean = part.direction[i] / part.direction[2];
    centre[i] = part.point_mm[i] + lean * part.balls_mm[0][2] - (tip(0)[i] + tip(std::numbers::pi)[i]) / 2;
  }
  return centre;
}

}  // namespace probebox::scenario
