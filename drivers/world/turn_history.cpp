#include "drivers/world/turn_history.hpp"

#include <algorithm>

namespace probebox::world {

void TurnHistory::append(double to_rad, MonoTime from, MonoTime until) {
  turns_[count_++ % kRemembered] = {from, until, to_rad_, to_rad};
  to_rad_ = to_rad;
}

double TurnHistory::angleAt(MonoTime at, double delay_s) const {
  const std::uint64_t oldest = count_ > kRemembered ? count_ - kRemembered : 0;
  for (std::uint64_t i = count_; i > oldest; --i) {
    const Turn& turn = turns_[(i - 1) % kRemembered];
    const double since_s = toSeconds(at - turn.from) - delay_s, lasts_s = toSeconds(turn.until - turn.from);
    if (since_s < 0) continue;
    if (since_s >= lasts_s) return turn.to_rad;
    return turn.from_rad + since_s / lasts_s * (turn.to_rad - turn.from_rad);
  }
  return count_ > 0 ? turns_[oldest % kRemembered].from_rad : to_rad_;
}

}  // namespace probebox::world
