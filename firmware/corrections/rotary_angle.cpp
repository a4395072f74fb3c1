#include "firmware/corrections/rotary_angle.hpp"

#include <cmath>

#include "protocol/units/angle.hpp"

namespace probebox::corrections {
void RotaryAngle::push(const AngleCount& count) {
  if (!config_.described || config_.from != AngleFrom::encoder) return;
  reference_.push(count.at, config_.wraps ? unwrapped(count) : count.counts);
  heard_at_ = count.at;
}

// The axis went the shorter way, unless it was silent for so long that it can have gone the longer one.
std::int64_t RotaryAngle::unwrapped(const AngleCount& count) {
  const double turn_counts = 360 / std::abs(config_.reference.mm_per_count);
  if (before_) {
    const double way_counts = static_cast<double>(count.counts) - static_cast<double>(before_->counts);
    const double way_deg = 360 * way_counts / turn_counts, shorter_deg = way_deg - std::copysign(360, way_deg);
    const Nanoseconds gap = count.at - before_->at;
    const bool may_be_longer = gap > AxisReference::kSilence && reference_.canMove(way_deg, toSeconds(gap));
    if (std::abs(way_deg) > 180 && !may_be_longer && reference_.canMove(shorter_deg, toSeconds(gap)))
      turns_ += way_counts < 0 ? 1 : -1;
  }
  before_ = count;
  // A controller may tell any number, and sums of signed ones may not run over.
  const auto left_out = static_cast<std::uint64_t>(std::llround(turns_ * turn_counts));
  return static_cast<std::int64_t>(static_cast<std::uint64_t>(count.counts) + left_out);
}

void RotaryAngle::encoderLost(bool is_gone) {
  reference_.encoderLost(is_gone);
  if (!is_gone) return;
  before_.reset();
  turns_ = 0;
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
