#include "tools/probebox/text/due.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "tools/probebox/text/report.hpp"

namespace probebox::command {

std::string durationText(double days) {
  constexpr double kHours = 24, kMinutes = 1440;  // of a day
  const auto counted = [](double number, const char* unit, const char* plural) {
    return printed("%.0f ", number) + (std::round(number) == 1 ? unit : plural);
  };
  if (days < 1 / kHours) return counted(std::max(1.0, days * kMinutes), "min", "min");
  if (days < 2) return counted(days * kHours, "h", "h");
  return counted(days, "day", "days");
}

std::string dueText(const published::Due& due) {
  constexpr double kDay_s = 86'400;
  if (due.state == published::DueState::not_measured) return "not measured";
  if (due.state == published::DueState::not_known) return "not known whether it is due: measure again";
  const bool overdue = due.state == published::DueState::overdue;
  std::string all;
  const auto add = [&](bool is_known, double remaining, const std::string& amount) {
    if (is_known && (remaining < 0) == overdue) all += (all.empty() ? "" : overdue ? " and " : " or ") + amount;
  };
  add(due.has_time, due.remaining_s, durationText(std::abs(due.remaining_s) / kDay_s));
  add(due.has_cutting, due.remaining_cutting_s,
      durationText(std::abs(due.remaining_cutting_s) / kDay_s) + " of cutting");
  add(due.has_temperature, due.remaining_temperature_k, printed("%.2g K", std::abs(due.remaining_temperature_k)));
  return (overdue ? "overdue by " : "due in ") + all;
}

}  // namespace probebox::command
