#pragma once
#include <chrono>
#include <optional>
#include <string>
#include <string_view>

// Days and times of the calendar as texts, ISO 8601.
namespace probebox {

// Reads a day such as "2026-04-17". Nothing when the calendar has no such day, or its year is before 1990.
std::optional<std::chrono::year_month_day> dayOf(std::string_view text);

// Writes a time of UTC: "2026-11-26T08:15:00Z".
std::string isoUtc(std::chrono::sys_seconds time);

}  // namespace probebox
