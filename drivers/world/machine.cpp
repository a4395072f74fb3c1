#include "drivers/world/machine.hpp"

#include <algorithm>
#include <cmath>

namespace probebox::world {
namespace {

constexpr std::uint64_t kStream = 11;

}  // namespace

Machine::Machine(const Config& config, std::uint64_t seed)
    : axes_{config.axes},
      rotary_{config.rotary},
      probe_spindle_{config.probe_spindle},
      motion_{config.axes.home_mm},
      solids_{config},
      stylus_{config.probe},
      random_{seed, kStream} {
  probe_spindle_.direction = unit(probe_spindle_.direction);
  hold_ = holdAt(0);
}

bool Machine::moveTo(const Vector3& target_mm, double speed_mm_s, MonoTime now) {
  if (!atRest(now)) return false;
  if (target_mm == motion_.target()) return true;
  const Move& move = motion_.append(target_mm, {speed_mm_s, axes_.acceleration_mm_s2, axes_.jerk_time_s}, now);
  stylus_.follow(move, solids_, hold_);
  return true;
}

bool Machine::turnTo(double a_rad, double c_rad, MonoTime now) {
  if (!atRest(now)) return false;
  const double way_rad = std::max(std::abs(a_rad - commanded_a_rad_), std::abs(c_rad - commanded_c_rad_));
  if (way_rad == 0) return true;
  const Contact* last = stylus_.contactCount() > 0 ? stylus_.contact(stylus_.contactCount() - 1) : nullptr;
  const bool touching = last != nullptr && !last->end;
  if (touching || solids_.swept(motion_.target() + hold_.tip, commanded_c_rad_, c_rad)) ++crashes_;
  if (a_rad != commanded_a_rad_) hold_ = holdAt(stopAt(a_rad));
  if (c_rad != commanded_c_rad_) solids_.turnPart(stopAt(c_rad));
  turned_from_c_rad_ = commanded_c_rad_;
  turns_since_ = now;
  commanded_a_rad_ = a_rad;
  commanded_c_rad_ = c_rad;
  turned_at_ = now + Nanoseconds{std::llround(1e9 * way_rad / rotary_.speed_rad_s)};
  return true;
}

// At constant speed on its way.
double Machine::partAngleAt(MonoTime at, double delay_s) const {
  const MonoTime seen = at - Nanoseconds{std::llround(1e9 * delay_s)};
  if (seen >= turned_at_) return commanded_c_rad_;
  if (seen <= turns_since_) return turned_from_c_rad_;
  const double share = toSeconds(seen - turns_since_) / toSeconds(turned_at_ - turns_since_);
  return turned_from_c_rad_ + share * (commanded_c_rad_ - turned_from_c_rad_);
}

// The reference lies on the spindle's axis; the ball hangs below it. Positions count from where an ideal spindle would
// hold the ball.
Hold Machine::holdAt(double a_rad) const {
  const auto& [x, y] = probe_spindle_.stylus_offset_mm;
  const Vector3 hanging{x, y, -probe_spindle_.stylus_length_mm};
  const Matrix3 turned = rotation(probe_spindle_.direction, a_rad);
  return {.tip = turned * hanging + Vector3{0, 0, probe_spindle_.stylus_length_mm}, .turned = turned};
}

}  // namespace probebox::world
