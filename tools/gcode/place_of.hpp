#pragma once
#include <Eigen/Core>
#include <array>
#include <optional>

#include "firmware/procedure/plan/step.hpp"
#include "protocol/units/outcome.hpp"
#include "tools/gcode/route.hpp"
#include "tools/gcode/setting.hpp"

namespace probebox::gcode {

inline Eigen::Vector3d vectorOf(const std::array<double, 3>& v) { return {v[0], v[1], v[2]}; }

// A jog or a sweep: no feature is touched.
bool movesOneAxis(const procedure::Step& step);
// Explains what the setting lacks for this step; nullopt when it has all.
std::optional<Error> whyUnknown(const procedure::Step& step, const Setting& setting);
// Where the feature of a step stands in the pose of that step, for a setting that lacks nothing.
Place placeOf(const procedure::Step& step, const Setting& setting);
// Where the tip meets the surface.
Eigen::Vector3d surfaceOf(const procedure::Step& step, const Place& place, const Setting& setting);

}  // namespace probebox::gcode
