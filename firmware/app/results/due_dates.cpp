#include "firmware/app/results/due_dates.hpp"

#include <algorithm>
#include <memory>

#include "firmware/app/results/wall_clock.hpp"

namespace probebox::app {

std::vector<published::Due> DueDates::all() const {
  const std::lock_guard lock{mutex_};
  return recent();
}

std::uint16_t DueDates::count() const {
  const std::lock_guard lock{mutex_};
  return static_cast<std::uint16_t>(std::ranges::count_if(recent(), published::isDue, &published::Due::state));
}

const std::vector<published::Due>& DueDates::recent() const {
  if (schedules_.empty()) return all_;
  const auto now = std::chrono::steady_clock::now();
  if (!looked_ || now - *looked_ > std::chrono::seconds{1}) {
    all_ = look();
    looked_ = now;
  }
  return all_;
}

std::vector<published::Due> DueDates::look() const {
  const auto records = results_.records();
  results::Circumstances now{.utc = dateNow().at, .cutting = cutting_.count()};
  // The box has no thermometer: what was stated last counts.
  store::Id newest = 0;
  for (const auto& record : records) {
    const auto then = results::circumstancesOf(*record);
    if (!then.temperature_c || record->id < newest) continue;
    newest = record->id;
    now.temperature_c = then.temperature_c;
  }
  std::vector<published::Due> all;
  for (const auto& schedule : schedules_) {
    const auto found = std::ranges::find(records, schedule.subject, [](const auto& r) { return r->binding.subject; });
    all.push_back(results::dueOf(schedule, found == records.end() ? nullptr : found->get(), now));
  }
  return all;
}

}  // namespace probebox::app
