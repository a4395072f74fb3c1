#include "firmware/corrections/rotary_angle.hpp"

#include "protocol/units/angle.hpp"

namespace probebox::corrections {
void RotaryAngle::push(const AngleCount& count) {
  if (!config_.described || config_.from != AngleFrom::encoder) return;
  reference_.push(count.at, count.counts);
  heard_at_ = count.at;
}

bool RotaryAngle::told(double angle_rad, MonoTime at) {
  if (!config_.described) return true;
  if (config_.from == AngleFrom::controller) {
    told_rad_ = angle_rad;
    heard_at_ = at;
    return true;
  }
  const bool tells_itself = config_.reference.by == ReferenceBy::absolute;
  // A controller that goes on telling where the axis is while it turns references nothing, and does no harm.
  return tells_itself || reference_.homed(angle_rad / kDegree, at) || reference_.referenced();
}

bool RotaryAngle::known() const {
  if (!config_.described) return false;
  return config_.from == AngleFrom::controller ? told_rad_.has_value() : reference_.position_mm().has_value();
}

std::optional<double> RotaryAngle::latched_rad() const {
  if (config_.from != AngleFrom::encoder || !known()) return std::nullopt;
  return *reference_.position_mm() * kDegree;
}

AngleNow RotaryAngle::at(MonoTime now) const {
  if (!known()) return {};
  const auto latched = latched_rad();
  return {.rad = latched ? *latched : *told_rad_,
          .doubtful = config_.stale > Nanoseconds{} && now - heard_at_ > config_.stale};
}

}  // namespace probebox::corrections
