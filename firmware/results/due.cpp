#include "firmware/results/due.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <string_view>

#include "firmware/metrology/dataset/conditions.hpp"
#include "protocol/units/calendar.hpp"

namespace probebox::results {
namespace {

using published::Due;
using published::DueState;

constexpr std::string_view kOf = " of ";

const std::string* conditionNamed(const store::Record& record, std::string_view name) {
  if (record.result() == nullptr) return nullptr;
  const auto& all = record.result()->conditions;
  const auto found = std::ranges::find(all, name, &metrology::Condition::name);
  return found == all.end() ? nullptr : &found->value;
}

std::optional<double> numberNamed(const store::Record& record, std::string_view name) {
  const auto* text = conditionNamed(record, name);
  double value = 0;
  if (text == nullptr || std::from_chars(text->data(), text->data() + text->size(), value).ec != std::errc{})
    return std::nullopt;
  return value;
}

// Takes one limit of a schedule: what remains of it, where that is known.
void take(Due& due, bool& is_known, double& remaining, const std::optional<double>& left) {
  is_known = left.has_value();
  remaining = left.value_or(0);
  if (!left && due.state == DueState::good) due.state = DueState::not_known;
  if (left && *left < 0) due.state = DueState::overdue;
}

}  // namespace

std::string CuttingCount::text() const {
  return std::to_string(static_cast<std::uint64_t>(s)) + std::string{kOf} + counter;
}

std::optional<CuttingCount> CuttingCount::parse(std::string_view text) {
  CuttingCount count;
  const auto at = text.find(kOf);
  if (at == std::string_view::npos) return std::nullopt;
  const auto number = text.substr(0, at);
  const auto [end, error] = std::from_chars(number.data(), number.data() + number.size(), count.s);
  if (error != std::errc{} || end != number.data() + number.size()) return std::nullopt;
  count.counter = text.substr(at + kOf.size());
  return count;
}

Circumstances circumstancesOf(const store::Record& record) {
  const auto* utc = conditionNamed(record, "measured_utc");
  const auto* cutting = conditionNamed(record, metrology::kCuttingKey);
  return {.utc = utc == nullptr ? std::nullopt : timeOf(*utc),
          .cutting = cutting == nullptr ? std::nullopt : CuttingCount::parse(*cutting),
          .temperature_c = numberNamed(record, "temperature_c")};
}

Due dueOf(const Schedule& schedule, const store::Record* in_force, const Circumstances& now) {
  Due due;
  due.name = schedule.subject;
  if (in_force == nullptr) {
    due.state = DueState::not_measured;
    return due;
  }
  due.result_id = in_force->id;
  const auto then = circumstancesOf(*in_force);
  if (schedule.days) {
    constexpr double kDay_s = 86'400;
    std::optional<double> left_s;
    if (then.utc) {
      const auto at = *then.utc + std::chrono::seconds{std::llround(*schedule.days * kDay_s)};
      due.due_utc = isoUtc(at);
      if (now.utc) left_s = static_cast<double>((at - *now.utc).count());
    }
    take(due, due.has_time, due.remaining_s, left_s);
  }
  if (schedule.cutting_h) {
    constexpr double kHour_s = 3600;
    std::optional<double> left_s;
    if (then.cutting && now.cutting && then.cutting->counter == now.cutting->counter)
      left_s = *schedule.cutting_h * kHour_s - (now.cutting->s - then.cutting->s);
    take(due, due.has_cutting, due.remaining_cutting_s, left_s);
  }
  if (schedule.temperature_k) {
    std::optional<double> left_k;
    if (then.temperature_c && now.temperature_c)
      left_k = *schedule.temperature_k - std::abs(*now.temperature_c - *then.temperature_c);
    take(due, due.has_temperature, due.remaining_temperature_k, left_k);
  }
  return due;
}

}  // namespace probebox::results
