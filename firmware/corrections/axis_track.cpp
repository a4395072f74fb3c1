#include "firmware/corrections/axis_track.hpp"

#include <algorithm>

#include "firmware/corrections/longest_gap.hpp"

namespace probebox::corrections {

std::optional<double> AxisTrack::at(MonoTime at) const {
  if (!reaches(at)) return std::nullopt;
  const std::size_t oldest = count_ - std::min(count_, kKept);
  for (std::size_t i = count_ - 1; i > oldest; --i) {
    const Latched &before = latched(i - 1), &after = latched(i);
    if (before.at > at) continue;
    const Nanoseconds gap = after.at - before.at;
    if (gap <= Nanoseconds{} || gap > kLongestGap) return std::nullopt;
    const double share = toSeconds(at - before.at) / toSeconds(gap);
    return before.value + share * (after.value - before.value);
  }
  return std::nullopt;
}

}  // namespace probebox::corrections
