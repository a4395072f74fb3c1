#pragma once
#include <CLI/CLI.hpp>
#include <algorithm>
#include <cctype>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <sstream>
#include <string>
#include <string_view>

#include "protocol/units/calendar.hpp"
#include "protocol/units/wording.hpp"

// Validators of command-line values. Only parse.cpp and the headers that it alone includes use them.
namespace probebox::command {

inline bool readsAs(const std::string& text, auto& number) {
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  return error == std::errc{} && end == text.data() + text.size();
}

inline CLI::Validator seconds() {
  const auto check = [](std::string& text) {
    double value = 0;
    const bool good = readsAs(text, value) && std::isfinite(value) && value > 0;
    return good ? std::string{} : text + " is not a number of seconds above 0, such as 2.5";
  };
  return CLI::Validator{check, "", "seconds"};
}

inline CLI::Validator wholeNumber() {
  const auto check = [](std::string& text) {
    std::uint64_t value = 0;
    return readsAs(text, value) && value > 0 ? std::string{} : text + " is not a whole number above 0, such as 17";
  };
  return CLI::Validator{check, "", "number"};
}

inline CLI::Validator speed() {
  const auto check = [](std::string& text) {
    double value = 0;
    const bool good = text == "max" || (readsAs(text, value) && std::isfinite(value) && value > 0);
    return good ? std::string{} : text + " is neither max nor a number above 0, such as 10";
  };
  return CLI::Validator{check, "", "speed"};
}

// Unlike CLI::PositiveNumber, refuses nan and inf.
inline CLI::Validator positive() {
  const auto check = [](std::string& text) {
    double value = 0;
    const bool good = readsAs(text, value) && std::isfinite(value) && value > 0;
    return good ? std::string{} : text + " is not a number above 0, such as 12.5";
  };
  return CLI::Validator{check, "", "positive number"};
}

// Unlike CLI::Range, refuses nan.
inline CLI::Validator between(double least, double most) {
  const auto check = [=](std::string& text) {
    double value = 0;
    if (readsAs(text, value) && value >= least && value <= most) return std::string{};
    std::ostringstream said;
    said << text << " is not a number from " << least << " to " << most;
    return said.str();
  };
  return CLI::Validator{check, "", "number"};
}

inline CLI::Validator wholeBetween(std::uint64_t least, std::uint64_t most) {
  const auto check = [=](std::string& text) {
    std::uint64_t value = 0;
    const bool good = readsAs(text, value) && value >= least && value <= most;
    return good ? std::string{}
                : text + " is not a whole number from " + std::to_string(least) + " to " + std::to_string(most);
  };
  return CLI::Validator{check, "", "number"};
}

// The path of a device, such as "/dev/ttyS1", of characters that a G-code program may hold.
inline CLI::Validator device() {
  const auto check = [](std::string& text) {
    const auto usual = [](unsigned char c) {
      return std::isalnum(c) != 0 || std::string_view{"/._:-"}.find(static_cast<char>(c)) != std::string_view::npos;
    };
    const bool good = text.starts_with('/') && std::ranges::all_of(text, usual);
    return good ? std::string{} : text + " is not the path of a device, such as /dev/ttyS1";
  };
  return CLI::Validator{check, "", "device"};
}

// An axis with its machine position in mm, such as "X=120.5".
inline CLI::Validator axisPosition() {
  const auto check = [](std::string& text) {
    double value = 0;
    const bool named = text.size() > 2 && std::string{"XYZxyz"}.find(text.front()) != std::string::npos;
    const bool good = named && text[1] == '=' && readsAs(text.substr(2), value) && std::isfinite(value);
    return good ? std::string{} : text + " is not an axis with its machine position in mm, such as X=120.5";
  };
  return CLI::Validator{check, "", "axis and position"};
}

inline CLI::Validator fileName() {
  const auto check = [](std::string& text) { return text.empty() ? "the name of the file is empty" : std::string{}; };
  return CLI::Validator{check, "", "file name"};
}

// Refuses an empty argument, as of a variable that is not set.
inline CLI::Validator anyName() {
  const auto check = [](std::string& text) { return text.empty() ? "the name is empty" : std::string{}; };
  return CLI::Validator{check, "", "name"};
}

// A day of the calendar, such as "2027-11-26".
inline CLI::Validator day() {
  const auto check = [](std::string& text) {
    return dayOf(text) ? std::string{} : text + " is not a day, such as 2027-11-26";
  };
  return CLI::Validator{check, "", "day"};
}

inline CLI::Validator personsName() {
  const auto check = [](std::string& text) {
    const auto why = whyNoName(text);
    if (!why) return std::string{};
    return why->what.ends_with('.') ? why->what.substr(0, why->what.size() - 1) : why->what;  // a sentence goes on
  };
  return CLI::Validator{check, "", "name"};
}

}  // namespace probebox::command
