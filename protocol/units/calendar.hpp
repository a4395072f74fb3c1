#pragma once
#include <chrono>
#include <optional>
#include <string>
#include <string_view>

// Days and times of the calendar as texts, ISO 8601.
namespace probebox {

// Reads a day such as "2026-04-17". Nothing when the calendar has no such day, or its year is before 1990.
std::optional<std::chrono::year_month_day> dayOf(std::string_view text);

// Reads a time of UTC such as "2026-11-26T08:15:00Z", or the beginning of a day such as "2026-11-26".
std::optional<std::chrono::sys_seconds> timeOf(std::string_view text);

// Whether a clock may show it and be right: not before this was written, nor decades later. One that was never set, or
// whose battery is empty, shows other times.
bool couldBeNow(std::chrono::sys_seconds time);

// Writes a time of UTC: "2026-11-26T08:15:00Z".
std::string isoUtc(std::chrono::sys_seconds time);

}  // namespace probebox
