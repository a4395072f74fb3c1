#pragma once
#include "drivers/world/config.hpp"
#include "drivers/world/motion.hpp"
#include "drivers/world/stylus.hpp"
#include "drivers/world/vector.hpp"
#include "protocol/units/time.hpp"

namespace probebox::world {

// Three linear axes that carry the probe. Positions are of the stylus ball's centre while the stylus is free, mm.
class Machine {
 public:
  explicit Machine(const Config& config);

  // Commands, for a controller.

  // A straight move from rest to rest, starting at `now`. False, and nothing happens, while the last one is under way.
  bool moveTo(const Vector3& target_mm, double speed_mm_s, MonoTime now);
  bool traverseTo(const Vector3& target_mm, MonoTime now) { return moveTo(target_mm, axes_.traverse_mm_s, now); }
  bool atRest(MonoTime now) const { return motion_.atRest(now); }
  Vector3 commandedPosition() const { return motion_.target(); }

  // The truth, for the sensors and for tests, `delay_s` before `at`.

  Vector3 positionAt(MonoTime at, double delay_s = 0) const { return motion_.positionAt(at, delay_s); }
  double speedAt(MonoTime at) const { return motion_.speedAt(at); }
  // Centre of the stylus ball minus positionAt(), mm, in machine axes.
  Vector3 stylusDisplacementAt(MonoTime at, double delay_s = 0) const {
    return stylus_.displacement(positionAt(at, delay_s), at, delay_s);
  }
  const Stylus& stylus() const { return stylus_; }

 private:
  AxesConfig axes_;
  MotionHistory motion_;
  Stylus stylus_;
};

}  // namespace probebox::world
