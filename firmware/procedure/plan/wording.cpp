#include "firmware/procedure/plan/wording.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>

namespace probebox::procedure {

std::string number(double value) {
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), "%g", value);
  return text.data();
}

std::size_t axisAlong(const std::array<double, 3>& direction) {
  const auto along = std::ranges::max_element(direction, {}, [](double c) { return std::abs(c); });
  return static_cast<std::size_t>(along - direction.begin());
}

std::string mountPrompt(const capture::TouchRequest& touch, bool clamps_further_out) {
  if (touch.mount <= 1) return {};
  const std::string mount = "mount " + std::to_string(touch.mount) + ", ";
  return clamps_further_out ? "the ball clamped further out, in " + mount : "the balls in " + mount;
}

std::string preTravelCommand(std::uint32_t tool) {
  return "probebox calibrate pre-travel" + (tool == 0 ? "" : " --tool " + std::to_string(tool));
}

}  // namespace probebox::procedure
