#include "firmware/corrections/trigger_log.hpp"

#include <algorithm>
#include <cmath>

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

void TriggerLog::counted(Axis axis, MonoTime at, double position_mm) {
  const auto i = static_cast<std::size_t>(axis);
  paths_[i].push(at - tau_[i], position_mm);
  placeWaiting();
}

void TriggerLog::setDelay(Axis axis, double tau_s) {
  tau_[static_cast<std::size_t>(axis)] = Nanoseconds{std::llround(tau_s * 1e9)};
  forget(axis);
}

void TriggerLog::encodersLost() {
  for (auto& track : tracks_) track.clear();
  for (auto& path : paths_) path.clear();
}

std::optional<TriggerStamp> TriggerLog::next() {
  if (given_ == first_) return std::nullopt;
  return waiting_[given_++ % kWaiting];
}

void TriggerLog::placeWaiting() {
  if (tick_count_ == 0) return;
  const MachineTick& newest = ticks_[(tick_count_ - 1) % kTicks];
  for (; placed_ < end_ && waiting_[placed_ % kWaiting].at <= newest.at; ++placed_) {
    TriggerStamp& stamp = waiting_[placed_ % kWaiting];
    if (awaitsCounts(stamp, newest)) break;
    if (!place(stamp)) ++unplaced_;
  }
  for (; first_ < placed_ && !awaitsAngles(waiting_[first_ % kWaiting], newest.at); ++first_) {
    TriggerStamp& stamp = waiting_[first_ % kWaiting];
    turn(stamp);
    newest_ = stamp;
  }
}

// Counts come later than the ticks that stand in for samples, by the delay and the way to the box.
bool TriggerLog::awaitsCounts(const TriggerStamp& stamp, const MachineTick& newest) const {
  if (!newest.by_counts) return false;
  for (std::size_t axis = 0; axis < kLinearAxes; ++axis) {
    const bool may_come = newest.at - stamp.at <= kLongestGap + std::max(Nanoseconds{}, tau_[axis]);
    if (newest.position_mm[axis] && may_come && !paths_[axis].reaches(stamp.at)) return true;
  }
  return false;
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
    const bool by_counts = before.by_counts || after.by_counts;
    if (gap <= Nanoseconds{} || (gap > kLongestGap && !by_counts)) return false;
    const double share = toSeconds(stamp.at - before.at) / toSeconds(gap);
    for (std::size_t axis = 0; axis < kRotaryAxes; ++axis) {
      const AngleNow& told = before.angles[axis];
      stamp.has_angle[axis] = told.rad && !told.doubtful;
      stamp.angle_rad[axis] = stamp.has_angle[axis] ? *told.rad : 0;
    }
    if (by_counts) return placeByCounts(stamp, after);
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

// Returns whether each axis with a reference has a position. An encoder that is silent gives none, whatever its latest
// count was.
bool TriggerLog::placeByCounts(TriggerStamp& stamp, const MachineTick& after) const {
  bool all = true;
  for (std::size_t axis = 0; axis < kLinearAxes; ++axis) {
    if (!after.position_mm[axis]) continue;
    const auto position_mm = paths_[axis].at(stamp.at);
    stamp.has_position[axis] = position_mm.has_value();
    stamp.position_mm[axis] = position_mm.value_or(0);
    all = all && position_mm;
  }
  return all;
}

}  // namespace probebox::corrections
