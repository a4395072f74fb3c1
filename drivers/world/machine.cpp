#include "drivers/world/machine.hpp"

namespace probebox::world {

Machine::Machine(const Config& config)
    : axes_{config.axes}, motion_{config.axes.home_mm}, stylus_{config.sphere, config.probe} {}

bool Machine::moveTo(const Vector3& target_mm, double speed_mm_s, MonoTime now) {
  if (!motion_.atRest(now)) return false;
  if (target_mm == motion_.target()) return true;
  stylus_.follow(motion_.append(target_mm, {speed_mm_s, axes_.acceleration_mm_s2, axes_.jerk_time_s}, now));
  return true;
}

}  // namespace probebox::world
