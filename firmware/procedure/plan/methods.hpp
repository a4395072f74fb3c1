#pragma once
#include <optional>
#include <span>
#include <string_view>

#include "firmware/procedure/plan/method.hpp"

namespace probebox::procedure {

std::string_view nameOf(Method method);
std::optional<Method> methodNamed(std::string_view name);
// The names of the methods that a box can run, for messages to a person.
std::span<const std::string_view> methodNames();
// False for the selftest: it says what it found, and there is nothing of it that could be in force.
bool isCalibration(Method method);

Needs needsOf(Method method);
// It measures the tool that the options name, on the device that tells of touches by its edges.
bool measuresATool(Method method);
// It reads the centres of balls, with the delay in force taken out.
bool readsBalls(Method method);

// It reads balls with a sensor head in the place of the probe: always, or where it is asked to.
bool needsHead(Method method);
bool canReadByHead(Method method);

// It reads with several lengths, of which the shank of the stylus may be one.
bool canTouchByShank(Method method);

}  // namespace probebox::procedure
