#include "firmware/capture/near_contact.hpp"

#include <algorithm>
#include <chrono>
#include <iterator>
#include <optional>

#include "firmware/metrology/touch/retract.hpp"
#include "firmware/metrology/touch/switched_touch.hpp"

namespace probebox::capture {
namespace {

double square_mm2(const std::array<std::int32_t, 3>& channels_nm) {
  double square = 0;
  for (const std::int32_t channel : channels_nm) square += 1e-12 * channel * channel;
  return square;
}

struct Stretch {
  MonoTime from{}, until{};
};

Stretch aboutEdges(const Touch& touch) {
  const std::chrono::duration<double> way{metrology::kWayAtAnEdge_mm / touch.request.retract_speed_mm_s};
  const Nanoseconds margin = kFree + std::chrono::duration_cast<Nanoseconds>(way);
  return {*touch.contact - margin, *touch.release + margin};
}

std::optional<Stretch> aboutDeflection(const Recording& recording, const Touch& touch) {
  const auto rows = recording.probeRows(touch);
  double highest = 0;
  for (const ProbeRow& row : rows) highest = std::max(highest, square_mm2(row.channels_nm));
  const auto in_contact = [](const ProbeRow& row) { return isInContact(row.channels_nm); };
  const auto first = std::ranges::find_if(rows, in_contact);
  if (first == rows.end()) return std::nullopt;
  auto last = first, last_half = first;
  for (auto row = first; row != rows.end(); ++row) {
    if (!in_contact(*row)) continue;
    last = row;
    if (square_mm2(row->channels_nm) >= highest / 4) last_half = row;
  }
  // The stylus comes off in twice the time from half of its deflection on, and the machine goes on.
  const auto further =
      (metrology::RetractNeeds::kUntil - 1) * std::chrono::duration<double>{2 * (last->at - last_half->at)};
  // In a slow stream, or one with a hole, kFree may have no row.
  const auto before = std::prev(first, std::min(kFreeRows, std::distance(rows.begin(), first)));
  const auto after = std::next(last, std::min(kFreeRows, std::distance(last, rows.end()) - 1));
  return Stretch{std::min(first->at - kFree, before->at),
                 std::max(last->at + std::chrono::duration_cast<Nanoseconds>(further) + kFree, after->at)};
}

std::optional<Stretch> nearContact(const Recording& recording, const Touch& touch) {
  const auto& request = touch.request;
  if (request.sweeps || request.holds || request.until_contact || request.scan.count > 0) return std::nullopt;
  if (!request.by_edges) return aboutDeflection(recording, touch);
  if (!touch.contact || !touch.release || !(request.retract_speed_mm_s > 0)) return std::nullopt;
  return aboutEdges(touch);
}

}  // namespace

bool isInContact(const std::array<std::int32_t, 3>& channels_nm) {
  return square_mm2(channels_nm) >= kContact_mm * kContact_mm;
}

void keepNearContact(Recording& recording, Touch& newest) {
  if (const auto near = nearContact(recording, newest)) recording.keepWithin(near->from, near->until, newest);
}

}  // namespace probebox::capture
