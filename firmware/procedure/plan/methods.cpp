#include "firmware/procedure/plan/methods.hpp"

#include <algorithm>
#include <array>

#include "firmware/procedure/plan/method_table.hpp"

namespace probebox::procedure {

namespace {

constexpr std::array<std::string_view, kMethods.size()> kNames = [] {
  std::array<std::string_view, kMethods.size()> names{};
  for (std::size_t i = 0; i < names.size(); ++i) names[i] = kMethods[i].name;
  return names;
}();

}  // namespace

std::string_view nameOf(Method method) {
  const MethodRow* row = rowOf(method);
  return row != nullptr ? row->name : std::string_view{};
}

std::optional<Method> methodNamed(std::string_view name) {
  const auto* found = std::find(kNames.begin(), kNames.end(), name);
  if (found == kNames.end()) return std::nullopt;
  return kMethods[static_cast<std::size_t>(found - kNames.begin())].method;
}

std::span<const std::string_view> methodNames() {
  return kNames;
}

bool isCalibration(Method method) {
  return method != Method::none && method != Method::selftest;
}

Needs needsOf(Method method) {
  const MethodRow* row = rowOf(method);
  return row != nullptr ? row->needs : Needs::nothing;
}

bool measuresATool(Method method) {
  const MethodRow* row = rowOf(method);
  return row != nullptr && row->feature == Feature::tool_setter;
}

bool needsHead(Method method) {
  return needsOf(method) == Needs::sensor_head;
}

bool canReadByHead(Method method) {
  return needsHead(method) || method == Method::rotary_axis_errors;
}

bool canTouchByShank(Method method) {
  return needsOf(method) == Needs::probe_lengths || needsOf(method) == Needs::swivel_lengths;
}

bool readsBalls(Method method) {
  switch (needsOf(method)) {
    case Needs::delay_in_force:
    case Needs::checked_ball:
    case Needs::ball_plate:
    case Needs::tilting_table:
    case Needs::swivel_lengths:
    case Needs::swivel_head:
    case Needs::probe_lengths:
    case Needs::rim_ball:
      return true;
    default:
      return false;
  }
}

}  // namespace probebox::procedure
