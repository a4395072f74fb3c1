#include "firmware/procedure/plan.hpp"

#include <algorithm>
#include <cstdio>

namespace probebox::procedure {
namespace {

constexpr std::array<std::string_view, 1> kMethodNames{"delay-multi-speed"};

struct Direction {
  const char* name;
  std::array<double, 3> outward_normal;
};

constexpr std::array<Direction, 5> kFivePoints{{
    {"+X", {1, 0, 0}},
    {"-X", {-1, 0, 0}},
    {"+Y", {0, 1, 0}},
    {"-Y", {0, -1, 0}},
    {"+Z", {0, 0, 1}},
}};

}  // namespace

std::string_view nameOf(Method method) {
  const auto number = static_cast<std::size_t>(method);
  return number >= 1 && number <= kMethodNames.size() ? kMethodNames[number - 1] : std::string_view{};
}

std::optional<Method> methodNamed(std::string_view name) {
  const auto* found = std::find(kMethodNames.begin(), kMethodNames.end(), name);
  if (found == kMethodNames.end()) return std::nullopt;
  return static_cast<Method>(found - kMethodNames.begin() + 1);
}

std::span<const std::string_view> methodNames() {
  return kMethodNames;
}

Plan planMultiSpeed(const MultiSpeedOptions& options) {
  Plan plan{.method = Method::delay_multi_speed, .step_count = 0, .steps = {}};
  for (std::size_t i = 0; i < std::min(options.speed_count, MultiSpeedOptions::kMostSpeeds); ++i) {
    for (const Direction& direction : kFivePoints) {
      const capture::TouchRequest touch{.step = static_cast<std::uint32_t>(plan.step_count),
                                        .outward_normal = direction.outward_normal,
                                        .retract_direction = direction.outward_normal,
                                        .retract_speed_mm_s = options.speeds_mm_s[i]};
      plan.steps[plan.step_count++] = Step{touch, options.overtravel_mm, options.clearance_mm};
    }
  }
  return plan;
}

std::string promptFor(const Plan& plan, std::size_t step) {
  if (step >= plan.step_count) return {};
  const Step& wanted = plan.steps[step];
  const char* side = "";
  for (const Direction& direction : kFivePoints) {
    if (direction.outward_normal == wanted.touch.outward_normal) side = direction.name;
  }
  std::array<char, 160> text{};
  std::snprintf(text.data(), text.size(), "touch %zu of %zu: %s side of the sphere, %g mm deep, retract at %g mm/s",
                step + 1, plan.step_count, side, wanted.overtravel_mm, wanted.touch.retract_speed_mm_s);
  return text.data();
}

}  // namespace probebox::procedure
