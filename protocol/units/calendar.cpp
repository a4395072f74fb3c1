#include "protocol/units/calendar.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cstdio>
#include <string>

namespace probebox {

std::optional<std::chrono::year_month_day> dayOf(std::string_view text) {
  constexpr int kFirstYear = 1990;
  constexpr std::string_view kForm = "dddd-dd-dd";
  const auto fits = [](char c, char form) { return form == 'd' ? c >= '0' && c <= '9' : c == form; };
  if (text.size() != kForm.size() || !std::ranges::equal(text, kForm, fits)) return std::nullopt;
  const auto number = [&](std::size_t from, std::size_t count) {
    int value = 0;
    std::from_chars(text.data() + from, text.data() + from + count, value);
    return value;
  };
  const std::chrono::year_month_day day{std::chrono::year{number(0, 4)},
                                        std::chrono::month{static_cast<unsigned>(number(5, 2))},
                                        std::chrono::day{static_cast<unsigned>(number(8, 2))}};
  return day.ok() && number(0, 4) >= kFirstYear ? std::optional{day} : std::nullopt;
}

std::optional<std::chrono::sys_seconds> timeOf(std::string_view text) {
  using namespace std::chrono;
  const auto day = dayOf(text.substr(0, 10));
  if (!day) return std::nullopt;
  unsigned h = 0, min = 0, s = 0;
  if (text.size() > 10 && std::sscanf(std::string{text.substr(10)}.c_str(), "T%2u:%2u:%2u", &h, &min, &s) != 3)
    return std::nullopt;
  return sys_days{*day} + hours{h} + minutes{min} + seconds{s};
}

bool couldBeNow(std::chrono::sys_seconds time) {
  using namespace std::chrono;
  constexpr sys_days kWritten{year{2026} / November / 1};
  constexpr days kLongest{40 * 365};  // no box is in use for longer
  return time >= kWritten && time <= kWritten + kLongest;
}

std::string isoUtc(std::chrono::sys_seconds time) {
  const auto date = std::chrono::floor<std::chrono::days>(time);
  const std::chrono::year_month_day day{date};
  const std::chrono::hh_mm_ss of_day{time - date};
  std::array<char, 40> text{};
  std::snprintf(text.data(), text.size(), "%04d-%02u-%02uT%02d:%02d:%02dZ", static_cast<int>(day.year()),
                static_cast<unsigned>(day.month()), static_cast<unsigned>(day.day()),
                static_cast<int>(of_day.hours().count()), static_cast<int>(of_day.minutes().count()),
                static_cast<int>(of_day.seconds().count()));
  return text.data();
}

}  // namespace probebox
