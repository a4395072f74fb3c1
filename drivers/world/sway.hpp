#pragma once
#include <vector>

#include "board/describe/world.hpp"
#include "drivers/world/config.hpp"
#include "drivers/world/vector.hpp"
#include "protocol/units/time.hpp"

namespace probebox::world {

using Vibrates = board::WorldVibration::Of;

// Displaces something by time alone: its drift since the start of the world, and its vibrations. The body has those of
// the axes, which carry it, too.
class Sway {
 public:
  Sway(const Config& config, Vibrates what, const board::WorldDrift& drift = {});

  bool none() const { return none_; }
  // mm, at the instant `delay_s` before `at`. Exactly zero where nothing drifts or vibrates.
  Vector3 at(MonoTime at, double delay_s = 0) const;

 private:
  struct Line {
    Vector3 amplitude_mm{};
    double rad_s{};
  };

  MonoTime start_;
  board::WorldDrift drift_;
  std::vector<Line> lines_;
  bool none_;
};

}  // namespace probebox::world
