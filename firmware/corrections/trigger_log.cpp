#include "firmware/corrections/trigger_log.hpp"

#include <algorithm>

#include "firmware/corrections/longest_gap.hpp"

namespace probebox::corrections {

void TriggerLog::push(const Edge& edge, const Served& served) {
  ++count_;
  if (end_ - first_ == kWaiting) {
    ++unplaced_;
    return;
  }
  if (end_ - given_ == kWaiting) ++given_;
  waiting_[end_++ % kWaiting] = TriggerStamp{.number = count_,
                                             .line = edge.line,
                                             .line_sequence = edge.line_sequence,
                                             .at = edge.at,
                                             .has_position = {},
                                             .position_mm = {},
                                             .served = served,
                                             .has_angle = {},
                                             .angle_rad = {}};
  placeWaiting();
}

void TriggerLog::tick(const MachineTick& tick) {
  ticks_[tick_count_++ % kTicks] = tick;
  placeWaiting();
}

void TriggerLog::turned(RotaryAxis axis, MonoTime at, double angle_rad) {
  tracks_[static_cast<std::size_t>(axis)].push(at, angle_rad);
  placeWaiting();
}

void TriggerLog::encodersLost() {
  for (auto& track : tracks_) track.clear();
}

std::optional<TriggerStamp> TriggerLog::next() {
  if (given_ == first_) return std::nullopt;
  return waiting_[given_++ % kWaiting];
}

void TriggerLog::placeWaiting() {
  if (tick_count_ == 0) return;
  const MonoTime newest_tick = ticks_[(tick_count_ - 1) % kTicks].at;
  for (; placed_ < end_ && waiting_[placed_ % kWaiting].at <= newest_tick; ++placed_) {
    if (!place(waiting_[placed_ % kWaiting])) ++unplaced_;
  }
  for (; first_ < placed_ && !awaitsAngles(waiting_[first_ % kWaiting], newest_tick); ++first_) {
    TriggerStamp& stamp = waiting_[first_ % kWaiting];
    turn(stamp);
    newest_ = stamp;
  }
}

// The latch that follows the trigger may arrive after the tick that does.
bool TriggerLog::awaitsAngles(const TriggerStamp& stamp, MonoTime newest_tick) const {
  if (newest_tick - stamp.at > kLongestGap) return false;
  return std::ranges::any_of(tracks_, [&](const auto& track) { return !track.empty() && !track.reaches(stamp.at); });
}

void TriggerLog::turn(TriggerStamp& stamp) const {
  for (std::size_t axis = 0; axis < kRotaryAxes; ++axis) {
    if (tracks_[axis].empty()) continue;
    const auto angle_rad = tracks_[axis].at(stamp.at);
    stamp.has_angle[axis] = angle_rad.has_value();
    stamp.angle_rad[axis] = angle_rad.value_or(0);
  }
}

bool TriggerLog::place(TriggerStamp& stamp) const {
  const std::size_t oldest = tick_count_ - std::min(tick_count_, kTicks);
  for (std::size_t i = tick_count_ - 1; i > oldest; --i) {
    const MachineTick& before = ticks_[(i - 1) % kTicks];
    const MachineTick& after = ticks_[i % kTicks];
    if (before.at > stamp.at) continue;
    const Nanoseconds gap = after.at - before.at;
    if (gap <= Nanoseconds{} || gap > kLongestGap) return false;
    const double share = toSeconds(stamp.at - before.at) / toSeconds(gap);
    for (std::size_t axis = 0; axis < kRotaryAxes; ++axis) {
      const AngleNow& told = before.angles[axis];
      stamp.has_angle[axis] = told.rad && !told.doubtful;
      stamp.angle_rad[axis] = stamp.has_angle[axis] ? *told.rad : 0;
    }
    for (std::size_t axis = 0; axis < kLinearAxes; ++axis) {
      if (!before.position_mm[axis] || !after.position_mm[axis]) continue;
      stamp.has_position[axis] = true;
      stamp.position_mm[axis] =
          *before.position_mm[axis] + share * (*after.position_mm[axis] - *before.position_mm[axis]);
    }
    return true;
  }
  return false;
}

}  // namespace probebox::corrections
