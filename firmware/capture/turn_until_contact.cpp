#include "firmware/capture/turn_until_contact.hpp"

#include <algorithm>
#include <cmath>

#include "protocol/units/angle.hpp"

namespace probebox::capture {
namespace {

constexpr std::size_t kFewestAngles = 5;
constexpr std::size_t kAtRest = 5;  // rows before C turns: the controller waits after its marker

// First stamp at which the ball touches.
std::optional<MonoTime> contactOf(const Recording& recording, const Touch& touch) {
  if (touch.request.by_edges) return touch.contact;
  const auto rows = recording.probeRows(touch);
  for (std::size_t row = 0; row < rows.size(); ++row) {
    if (deflectionOf(rows, row) > kTouched_mm) return rows[row].at;
  }
  return std::nullopt;
}

}  // namespace

std::optional<double> angleAt(std::span<const AngleRow> rows, MonoTime at) {
  const auto after = std::ranges::lower_bound(rows, at, {}, &AngleRow::at);
  if (after == rows.end()) return std::nullopt;
  if (after->at == at) return after->c_rad;
  if (after == rows.begin()) return std::nullopt;
  const auto before = std::prev(after);
  const double share = toSeconds(at - before->at) / toSeconds(after->at - before->at);
  return before->c_rad + share * (after->c_rad - before->c_rad);
}

double deflectionOf(std::span<const ProbeRow> rows, std::size_t row) {
  const std::size_t first = std::min(kAtRest, rows.size());
  double squares = 0;
  for (std::size_t channel = 0; channel < 3; ++channel) {
    double rest_nm = 0;
    for (std::size_t i = 0; i < first; ++i)
      rest_nm += static_cast<double>(rows[i].channels_nm[channel]) / static_cast<double>(first);
    const double off_mm = 1e-6 * (static_cast<double>(rows[row].channels_nm[channel]) - rest_nm);
    squares += off_mm * off_mm;
  }
  return std::sqrt(squares);
}

TurnLacks lackOf(const Recording& recording, const Touch& touch) {
  const auto angles = recording.angleRows(touch);
  const auto contact = contactOf(recording, touch);
  if (!contact) return TurnLacks::contact;
  if (angles.size() < kFewestAngles) return TurnLacks::angles;
  const auto struck_rad = angleAt(angles, *contact);
  const bool released = !touch.request.by_edges || (touch.release && *touch.contact < *touch.release);
  if (!released) return TurnLacks::release;
  if (!struck_rad || (touch.release && !angleAt(angles, *touch.release))) return TurnLacks::angles;
  const double asked_rad = touch.request.until_contact->to_rad - touch.request.rotary_angles_rad[2];
  const double turned_rad = std::remainder(*struck_rad - angles.front().c_rad, kTurn);
  return asked_rad * turned_rad > 0 ? TurnLacks::nothing : TurnLacks::side;
}

}  // namespace probebox::capture
