#pragma once
#include <Eigen/Core>
#include <array>
#include <optional>

#include "firmware/procedure/plan/step.hpp"
#include "protocol/units/outcome.hpp"
#include "tools/gcode/route.hpp"
#include "tools/gcode/setting.hpp"

namespace probebox::gcode {

inline Eigen::Vector3d vectorOf(const std::array<double, 3>& v) {
  return {v[0], v[1], v[2]};
}

// Centre of a ball of the part (from 0) with A, B and C there. tilts: B is that of the table, whose axis is stated.
Eigen::Vector3d ballInPose(std::size_t ball, const std::array<double, 3>& angles_rad, bool tilts,
                           const Setting& setting);
// True for a jog or a sweep, which touches no feature.
bool movesOneAxis(const procedure::Step& step);
// Explains what the setting lacks for this step; nullopt when it is complete.
std::optional<Error> whyUnknown(const procedure::Step& step, const Setting& setting);
// Place of a step's feature in the pose of that step, for a setting that whyUnknown() accepts.
Place placeOf(const procedure::Step& step, const Setting& setting);
// Point at which the tip meets the surface.
Eigen::Vector3d surfaceOf(const procedure::Step& step, const Place& place, const Setting& setting);

}  // namespace probebox::gcode
