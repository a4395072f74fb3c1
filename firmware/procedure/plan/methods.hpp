#pragma once
#include <optional>
#include <span>
#include <string_view>

#include "firmware/procedure/plan/method.hpp"

namespace probebox::procedure {

std::string_view nameOf(Method method);
std::optional<Method> methodNamed(std::string_view name);
// Names of the methods that a box can run, for messages.
std::span<const std::string_view> methodNames();
// False for the selftest, whose findings cannot come into force.
bool isCalibration(Method method);

Needs needsOf(Method method);
// Tests whether the method measures the tool in the options, on the tool-setting device.
bool measuresATool(Method method);
// Tests whether the method reads centres of balls, corrected by the delay in force.
bool readsBalls(Method method);

// Tests whether the method reads balls with a sensor head: always (needsHead), or as an option (canReadByHead).
bool needsHead(Method method);
bool canReadByHead(Method method);

// Tests whether the shank may be one of the lengths that the method needs.
bool canTouchByShank(Method method);

}  // namespace probebox::procedure
