#include "tools/probebox/text/due.hpp"

#include <array>
#include <cmath>
#include <cstdio>

namespace probebox::command {
namespace {

std::string remaining(double value, const char* of) {
  std::array<char, 64> text{};
  std::snprintf(text.data(), text.size(), ", %.3g %s %s", std::abs(value), of, value < 0 ? "over" : "left");
  return text.data();
}

}  // namespace

std::string dueText(const published::Due& due) {
  constexpr double kDay_s = 86'400, kHour_s = 3600;
  auto text = due.name + ": " + std::string{nameOf(due.state)};
  if (due.has_time) text += remaining(due.remaining_s / kDay_s, "days");
  if (due.has_cutting) text += remaining(due.remaining_cutting_s / kHour_s, "h of cutting");
  if (due.has_temperature) text += remaining(due.remaining_temperature_k, "K");
  return text;
}

}  // namespace probebox::command
