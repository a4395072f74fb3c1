#include "firmware/results/core_events.hpp"

#include <algorithm>
#include <array>

namespace probebox::results {

std::vector<Event> eventsBetween(const Ledger& before, const Ledger& now, const Values& values,
                                 std::vector<std::string>& errors) {
  std::vector<Event> events;
  bool is_delay_changed = false;
  const auto addNone = [&](const std::string& subject) {
    if (isAbout(subject, SubjectKind::delay))
      is_delay_changed = true;
    else if (const auto none = values.none(subject))
      events.push_back(*none);
  };
  for (const auto* left : before.all(State::active, values.here))
    if (now.inForce(left->binding) == nullptr) addNone(left->binding.subject);
  auto present = now.all(State::active, values.here);
  std::ranges::sort(present, {}, &Entry::activated);
  for (const auto* entry : present) {
    const auto* was = before.inForce(entry->binding);
    if (was != nullptr && was->id == entry->id) continue;
    const auto record = values.record(entry->id);
    const auto own =
        record ? values.activation(*record) : Outcome<std::vector<Event>>{Error{"the store cannot read it any more"}};
    if (!own) {
      errors.push_back(named(entry->id) + " is not in force: " + own.error().what);
      if (was != nullptr) addNone(entry->binding.subject);
    } else if (isAbout(entry->binding.subject, SubjectKind::delay)) {
      is_delay_changed = true;
    } else {
      events.insert(events.end(), own->begin(), own->end());
    }
  }
  if (!is_delay_changed) return events;
  // An axis whose delay is no longer of one result may have one of another.
  if (const auto delay = delayByAxis(now, values))
    events.emplace_back(*delay);
  else if (const auto none = values.none(text(Subject{SubjectKind::delay, kAllAxes})))
    events.push_back(*none);
  return events;
}

std::optional<DelayActivated> delayByAxis(const Ledger& ledger, const Values& values) {
  std::optional<DelayActivated> by_axis;
  std::array<std::uint64_t, kLinearAxes> since{};
  std::uint64_t newest = 0, newest_gain = 0;
  for (const auto* entry : ledger.all(State::active, values.here)) {
    const auto observed = parseSubject(entry->binding.subject, SubjectKind::delay);
    const auto record = observed ? values.record(entry->id) : nullptr;
    const auto events = record ? values.activation(*record) : std::vector<Event>{};
    const auto* own = events && !events->empty() ? std::get_if<DelayActivated>(&events->front()) : nullptr;
    if (own == nullptr) continue;
    if (!by_axis) by_axis.emplace().at = own->at;
    const auto number = entry->activated;
    for (std::size_t axis = 0; axis < kLinearAxes; ++axis) {
      if (!observed->has(axis) || number < since[axis]) continue;
      since[axis] = number;
      by_axis->tau_s[axis] = own->tau_s[axis];
      by_axis->sd_s[axis] = own->sd_s[axis];
    }
    if (number >= newest) newest = number, by_axis->result_id = own->result_id;
    if (!own->has_gain || number < newest_gain) continue;
    newest_gain = number;
    by_axis->has_gain = true;
    by_axis->gain_ppm = own->gain_ppm;
    by_axis->sd_gain_ppm = own->sd_gain_ppm;
  }
  return by_axis;
}

}  // namespace probebox::results
