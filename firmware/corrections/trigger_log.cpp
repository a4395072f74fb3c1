#include "firmware/corrections/trigger_log.hpp"

#include <algorithm>

namespace probebox::corrections {
namespace {

// Across a longer gap nothing is interpolated.
constexpr Nanoseconds kLongestGap = std::chrono::milliseconds{25};

}  // namespace

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
                                             .served = served};
  placeWaiting();
}

void TriggerLog::tick(const MachineTick& tick) {
  ticks_[tick_count_++ % kTicks] = tick;
  placeWaiting();
}

std::optional<TriggerStamp> TriggerLog::next() {
  if (given_ == first_) return std::nullopt;
  return waiting_[given_++ % kWaiting];
}

void TriggerLog::placeWaiting() {
  if (tick_count_ == 0) return;
  const MonoTime newest_tick = ticks_[(tick_count_ - 1) % kTicks].at;
  for (; first_ < end_ && waiting_[first_ % kWaiting].at <= newest_tick; ++first_) {
    TriggerStamp& stamp = waiting_[first_ % kWaiting];
    if (!place(stamp)) ++unplaced_;
    newest_ = stamp;
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
