#include "firmware/capture/turn_until_contact.hpp"

#include <algorithm>
#include <cmath>

#include "protocol/units/angle.hpp"

namespace probebox::capture {
namespace {

constexpr std::size_t kFewestAngles = 5;
constexpr std::size_t kAtRest = 5;    // rows before C turns
constexpr double kTouched_mm = 0.03;  // a deflection that is a contact, and no noise or vibration

// First stamp at which the ball touches.
std::optional<MonoTime> contactOf(const Recording& recording, const Touch& touch) {
  if (touch.request.by_edges) return touch.contact;
  const auto rows = recording.probeRows(touch);
  const auto rest_mm = restOf(rows);
  const auto first =
      std::ranges::find_if(rows, [&](const ProbeRow& row) { return touches(deflectionFrom(rest_mm, row)); });
  if (first == rows.end()) return std::nullopt;
  return first->at;
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

std::array<double, 3> restOf(std::span<const ProbeRow> rows) {
  std::array<double, 3> rest_mm{};
  const auto first = rows.first(std::min(kAtRest, rows.size()));
  for (const auto& row : first) {
    for (std::size_t channel = 0; channel < 3; ++channel)
      rest_mm[channel] += 1e-6 * row.channels_nm[channel] / static_cast<double>(first.size());
  }
  return rest_mm;
}

std::array<double, 3> deflectionFrom(const std::array<double, 3>& rest_mm, const ProbeRow& row) {
  std::array<double, 3> deflection_mm{};
  for (std::size_t channel = 0; channel < 3; ++channel)
    deflection_mm[channel] = 1e-6 * row.channels_nm[channel] - rest_mm[channel];
  return deflection_mm;
}

bool touches(const std::array<double, 3>& deflection_mm) {
  const auto& [a, b, c] = deflection_mm;
  return std::hypot(a, b, c) > kTouched_mm;
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
