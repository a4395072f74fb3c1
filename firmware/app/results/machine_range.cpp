#include "firmware/app/results/machine_range.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <string>
#include <string_view>

#include "firmware/metrology/centreline/centreline_x.hpp"
#include "firmware/metrology/checks/plausible.hpp"
#include "firmware/metrology/dataset/quantity.hpp"
#include "firmware/metrology/dataset/subject.hpp"
#include "firmware/metrology/methods.hpp"
#include "protocol/units/tolerances.hpp"

namespace probebox::app {
namespace {

namespace quantity = metrology::quantity;

bool findsATurningAxis(const metrology::Result& result) {
  const auto* method = metrology::methodNamed(result.method);
  if (method == nullptr) return false;
  const auto& subject = method->subject.about;
  return subject && (subject->kind == SubjectKind::centreline || subject->kind == SubjectKind::centreline_tip);
}

std::string millimetres(double value) {
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), "%g mm", value);
  return text.data();
}

Error outside(const metrology::Result& result, const std::string& key, double value_mm, const std::string& limits) {
  return Error{"The result of " + result.method + " has " + key + " at " + millimetres(value_mm) + ", and " + limits +
               ": look for a gross error in its readings, or mend the travel in machine.toml."};
}

// From the machine's zero, over all axes; nothing where no axis is described.
std::optional<double> reachOf(const MachineTravel& travel) {
  double farthest = 0;
  double longest = 0;
  for (const auto& axis : travel) {
    if (!axis.isDescribed()) continue;
    farthest = std::max({farthest, std::abs(axis.min_mm), std::abs(axis.max_mm)});
    longest = std::max(longest, axis.max_mm - axis.min_mm);
  }
  return longest > 0 ? std::optional{farthest + longest + kMostToolLength_mm} : std::nullopt;
}

std::optional<Error> turningAxisOutside(const metrology::Result& result, const MachineTravel& travel) {
  const auto* centre = result.find(quantity::kCentre.key);
  if (centre == nullptr) centre = result.find(quantity::kCentreX.key);
  if (!findsATurningAxis(result) || centre == nullptr) return std::nullopt;
  for (std::size_t axis = 0; axis < std::min<std::size_t>(2, centre->values.size()); ++axis) {
    const auto& [min_mm, max_mm] = travel[axis];
    if (!travel[axis].isDescribed()) continue;
    const double beyond_mm = max_mm - min_mm;
    const double value_mm = centre->values[axis];
    if (value_mm >= min_mm - beyond_mm && value_mm <= max_mm + beyond_mm) continue;
    return outside(result, centre->key + " of " + "XY"[axis], value_mm,
                   "that axis travels from " + millimetres(min_mm) + " to " + millimetres(max_mm));
  }
  return std::nullopt;
}

}  // namespace

MachineTravel travelOf(const board::Machine& machine) {
  MachineTravel travel;
  for (std::size_t axis = 0; axis < kLinearAxes; ++axis)
    travel[axis] = {machine.axes[axis].travel_min_mm, machine.axes[axis].travel_max_mm};
  return travel;
}

std::optional<Error> validateRange(const AxisHomed& homed, const MachineTravel& travel) {
  const auto axis = static_cast<std::size_t>(homed.axis);
  const auto& [min_mm, max_mm] = travel[axis];
  if (std::isfinite(homed.position_mm) && (!travel[axis].isDescribed() || travel[axis].reaches(homed.position_mm)))
    return std::nullopt;
  return Error{std::string{"The axis "} + "XYZ"[axis] + " cannot be homed at " + millimetres(homed.position_mm) +
               ": its travel is " + millimetres(min_mm) + " to " + millimetres(max_mm) +
               " in machine.toml; give a position inside, or mend the travel."};
}

std::optional<Error> validateRange(const metrology::Result& result, const MachineTravel& travel) {
  const auto* method = metrology::methodNamed(result.method);
  const metrology::Method unknown{};
  if (const auto refusal = metrology::refuseImplausible(result, method == nullptr ? unknown : *method))
    return Error{"The result of " + result.method + " cannot be: " + refusal->reason + "."};
  const auto reach_mm = reachOf(travel);
  for (const auto* list : {&result.estimates, &result.also}) {
    for (const auto& estimate : *list) {
      if (!reach_mm || !estimate.key.ends_with("_mm")) continue;
      const auto far = std::ranges::find_if(estimate.values, [&](double mm) { return std::abs(mm) > *reach_mm; });
      if (far != estimate.values.end())
        return outside(result, estimate.key, *far,
                       "nothing on this machine is farther than " + millimetres(*reach_mm) + " from its zero");
    }
  }
  return turningAxisOutside(result, travel);
}

}  // namespace probebox::app
