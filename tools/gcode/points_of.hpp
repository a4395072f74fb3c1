#pragma once
#include <Eigen/Core>
#include <vector>

#include "tools/gcode/block.hpp"

namespace probebox::gcode {

// Points of the way of a move from one point on, for pictures and extents: its end, and points before it where it is an
// arc.
std::vector<Eigen::Vector3d> pointsOf(const Move& move, const Eigen::Vector3d& from_mm);

}  // namespace probebox::gcode
