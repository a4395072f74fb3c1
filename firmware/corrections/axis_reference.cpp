#include "firmware/corrections/axis_reference.hpp"

#include <algorithm>
#include <cmath>

namespace probebox::corrections {
namespace {

constexpr Nanoseconds kAnchorAge = std::chrono::milliseconds{100};
// Noise and quantisation of two counts that lie close together in time are no speed.
constexpr double kCountNoise_mm = 0.02;

}  // namespace

void AxisReference::setDelay(double tau_s, double sd_s) {
  const bool known = sd_s > 0;
  // Counts do not come before the mark that they are of: a delay below zero is the probe's, and theirs may be anything
  // from nothing to as much.
  tau_s_ = known ? std::max(0.0, tau_s) : 0;
  delay_uncertainty_s_ =
      known ? std::min(4 * sd_s + kEdgeUncertainty_s + std::max(0.0, -tau_s), kUnknownDelay_s) : kUnknownDelay_s;
}

bool AxisReference::canMove(double way_mm, double in_s) const {
  return std::abs(way_mm) <= config_.maximum_speed_mm_s * in_s + kCountNoise_mm;
}

void AxisReference::push(MonoTime at, std::int64_t counts) {
  const double u_mm = static_cast<double>(counts) * config_.mm_per_count;
  if (!has_count_) {
    has_count_ = true;
    if (config_.by == ReferenceBy::absolute) offset_mm_ = 0.0;
    still_since_.reset();
    next_anchor_ = Anchor{.at = at, .u_mm = u_mm, .sum_mm = 0, .counts = 0};
  } else if (at > at_) {
    const double dt_s = toSeconds(at - at_);
    const double moved_mm = u_mm - u_mm_;
    if (!canMove(moved_mm, dt_s)) {
      dropReference(ReferenceFault::impossible_speed);
      // The next one of an absolute encoder is as good as its first.
      if (config_.by == ReferenceBy::absolute) has_count_ = false;
    }
    if (const auto pulse = pending_index_) takeIndex(*pulse, moved_mm, dt_s, at, u_mm);
    followPass(at, u_mm);
    for (auto* anchor : {&still_since_, &next_anchor_}) {
      if (!*anchor) continue;
      (*anchor)->sum_mm += u_mm - (*anchor)->u_mm;
      ++(*anchor)->counts;
    }
    if (at - next_anchor_->at >= kAnchorAge) {
      still_since_ = next_anchor_;
      next_anchor_ = Anchor{.at = at, .u_mm = u_mm, .sum_mm = 0, .counts = 0};
    }
  }
  at_ = at;
  u_mm_ = u_mm;
}

void AxisReference::index(MonoTime at, std::optional<std::int64_t> latched_counts) {
  if (pending_index_ || !config_.has_mark) ++unused_indexes_;
  if (!config_.has_mark) return;
  pending_index_ = Pulse{.at = at, .latched_mm = {}};
  if (latched_counts) pending_index_->latched_mm = static_cast<double>(*latched_counts) * config_.mm_per_count;
}

// moved_mm, dt_s: from the count before to this one, which the pulse is due with if it is the first at that time or
// later.
void AxisReference::takeIndex(const Pulse& pulse, double moved_mm, double dt_s, MonoTime at, double u_mm) {
  const MonoTime due = pulse.latched_mm ? pulse.at : pulse.at + Nanoseconds{std::llround(tau_s_ * 1e9)};
  if (at < due) return;
  pending_index_.reset();
  if (pulse.latched_mm) return passIndex(*pulse.latched_mm, moved_mm / dt_s, 0);
  const double back_s = toSeconds(at - due);
  // Before the count before this one: no count around the mark was kept.
  if (back_s > dt_s) {
    ++unused_indexes_;
    return;
  }
  const double speed_mm_s = moved_mm / dt_s, passed_mm = u_mm - speed_mm_s * back_s;
  const double uncertainty_mm = std::abs(speed_mm_s) * delay_uncertainty_s_;
  if (delay_uncertainty_s_ < kUnknownDelay_s) return passIndex(passed_mm, speed_mm_s, uncertainty_mm);
  if (pass_) ++unused_indexes_;
  pass_ = Pass{.u_mm = passed_mm, .gone_mm = 0, .reach_mm = uncertainty_mm, .due = due};
}

// An axis that has just begun to move stands still yet in counts that come late: what they do next tells how fast it
// was.
void AxisReference::followPass(MonoTime at, double u_mm) {
  if (!pass_) return;
  const double gone_mm = u_mm - pass_->u_mm;
  const double since_s = toSeconds(at - pass_->due);
  pass_->reach_mm = std::max(pass_->reach_mm, std::abs(gone_mm));
  if (pass_->gone_mm == 0 || since_s <= kUnknownDelay_s) pass_->gone_mm = gone_mm;
  if (since_s < (zero_mm() ? kLongestDelay_s : kUnknownDelay_s)) return;
  const Pass pass = *pass_;
  pass_.reset();
  passIndex(pass.u_mm, pass.gone_mm / kUnknownDelay_s, pass.reach_mm);
}

void AxisReference::passIndex(double u_mm, double speed_mm_s, double uncertainty_mm) {
  const auto zero_mm = this->zero_mm();
  if (!zero_mm) {
    const bool is_unique = config_.by == ReferenceBy::index && config_.index_pitch_mm == 0;
    if (is_unique && uncertainty_mm <= config_.index_tolerance_mm) {
      offset_mm_ = nearestIndex_mm(0, speed_mm_s) - u_mm;
    } else {
      ++unused_indexes_;
    }
    return;
  }
  const double position_mm = u_mm + *zero_mm;
  const double off_mm = position_mm - nearestIndex_mm(position_mm, speed_mm_s);
  if (std::abs(off_mm) > config_.index_tolerance_mm + uncertainty_mm) return dropReference(ReferenceFault::wrong_index);
  offset_mm_ = zero_mm;  // an absolute encoder that disagreed with a mark is believed again
}

double AxisReference::nearestIndex_mm(double position_mm, double speed_mm_s) const {
  const double begins_mm = config_.index_mm + (speed_mm_s < 0 ? config_.index_width_mm : 0);
  if (config_.index_pitch_mm == 0) return begins_mm;
  return begins_mm + std::round((position_mm - begins_mm) / config_.index_pitch_mm) * config_.index_pitch_mm;
}

Homing AxisReference::homing(MonoTime now) const {
  if (config_.by == ReferenceBy::absolute) return Homing::absolute;
  if (isSilent(now, kSilence)) return Homing::silent;
  const bool stands = still_since_ && std::abs(u_mm_ - still_since_->u_mm) <= kStill_mm;
  return stands ? Homing::possible : Homing::moving;
}

bool AxisReference::homed(double position_mm, MonoTime now) {
  if (!std::isfinite(position_mm) || (config_.travel.isDescribed() && !config_.travel.reaches(position_mm)))
    return false;
  if (homing(now) != Homing::possible) return false;
  // The mean of what it showed while it stood still.
  const double mean_mm = still_since_->u_mm + still_since_->sum_mm / std::max(1, still_since_->counts);
  offset_mm_ = position_mm - mean_mm;
  return true;
}

std::optional<double> AxisReference::position_mm() const {
  if (!has_count_ || !offset_mm_) return std::nullopt;
  return u_mm_ + *offset_mm_;
}

std::optional<double> AxisReference::position_mm(double counts) const {
  if (!offset_mm_) return std::nullopt;
  return counts * config_.mm_per_count + *offset_mm_;
}

void AxisReference::encoderLost(bool is_gone) {
  if (config_.by == ReferenceBy::absolute && !is_gone) return;
  dropReference(ReferenceFault::encoder_lost);
  has_count_ = false;  // what comes next does not go on from there
}

void AxisReference::dropReference(ReferenceFault fault) {
  last_fault_ = fault;
  if (config_.by != ReferenceBy::absolute) ++breaks_;
  pending_index_.reset();
  pass_.reset();
  still_since_.reset();
  if (has_count_) next_anchor_ = Anchor{.at = at_, .u_mm = u_mm_, .sum_mm = 0, .counts = 0};
  if (!offset_mm_) return;
  offset_mm_.reset();
  ++losses_;
}

}  // namespace probebox::corrections
