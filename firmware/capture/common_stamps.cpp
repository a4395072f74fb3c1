#include "firmware/capture/common_stamps.hpp"

#include <cmath>

namespace probebox::capture {
namespace {

// Counts may wrap around, and so does their difference.
std::int64_t between(std::int64_t a, std::int64_t b, double share) {
  const auto from = static_cast<std::uint64_t>(a);
  const auto way = static_cast<double>(static_cast<std::int64_t>(static_cast<std::uint64_t>(b) - from));
  return static_cast<std::int64_t>(from + static_cast<std::uint64_t>(std::llround(share * way)));
}

}  // namespace

CommonStamps::CommonStamps(const std::array<Nanoseconds, kLinearAxes>& interval) : interval_{interval} {
  for (std::size_t axis = 0; axis < kLinearAxes; ++axis)
    if (interval_[axis] >= interval_[slowest_]) slowest_ = axis;
}

void CommonStamps::push(const Count& count, std::optional<std::int32_t> screw_nm) {
  auto& track = tracks_[static_cast<std::size_t>(count.axis)];
  if (track.end > 0 && count.at <= track.at(track.end - 1).at) return;
  track.points[track.end++ % Track::kKept] = {count.at, count.counts, screw_nm};
}

std::optional<CommonStamps::Row> CommonStamps::next() {
  const auto& slowest = tracks_[slowest_];
  for (; next_ < slowest.end; ++next_) {
    if (next_ < slowest.first()) {
      incomplete_ += slowest.first() - next_;
      next_ = slowest.first();
    }
    Row row{.at = slowest.at(next_).at, .counts = {}, .screw_nm = {}};
    Found found = Found::found;
    for (std::size_t axis = 0; axis < kLinearAxes && found == Found::found; ++axis) found = find(axis, row.at, row);
    if (found == Found::waiting) return std::nullopt;
    if (found == Found::found) {
      ++next_;
      return row;
    }
    ++incomplete_;
  }
  return std::nullopt;
}

CommonStamps::Found CommonStamps::find(std::size_t axis, MonoTime at, Row& row) const {
  const auto& track = tracks_[axis];
  if (interval_[axis].count() == 0) {
    row.screw_nm[axis] = 0;
    return Found::found;
  }
  if (track.end == 0 || track.at(track.end - 1).at < at) return Found::waiting;
  std::size_t after = track.end - 1;
  while (after > track.first() && track.at(after - 1).at >= at) --after;
  const Point& b = track.at(after);
  row.screw_nm[axis] = b.screw_nm;
  row.counts[axis] = b.counts;
  if (b.at == at) return Found::found;
  // More than 2.5 intervals are a gap, and nothing is interpolated over it.
  if (after == track.first() || 2 * (b.at - track.at(after - 1).at) > 5 * interval_[axis]) return Found::missing;
  const Point& a = track.at(after - 1);
  const double share = static_cast<double>((at - a.at).count()) / static_cast<double>((b.at - a.at).count());
  row.counts[axis] = between(a.counts, b.counts, share);
  return Found::found;
}

}  // namespace probebox::capture
