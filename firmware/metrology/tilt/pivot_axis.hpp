#pragma once
#include <Eigen/Core>

#include "firmware/metrology/dataset/dataset.hpp"
#include "firmware/metrology/dataset/method.hpp"
#include "firmware/metrology/dataset/result.hpp"
#include "protocol/units/outcome.hpp"

namespace probebox::metrology {

// A tilting or swivelling axis as a line in space.
struct TiltAxis {
  Eigen::Vector3d point = Eigen::Vector3d::Zero();  // mm
  Eigen::Vector3d direction = Eigen::Vector3d::UnitX();

  // (B31): position of a point after a tilt, rad, right-handed about the direction; mm. Does not allocate.
  Eigen::Vector3d tilted(const Eigen::Vector3d& at, double tilt_rad) const;
};

// Methods "table-pivot-3d" and "head-pivot-3d": the same readings as table-pivot and head-pivot, fitted in space, so
// that the axis need not be parallel to its machine axis (docs/metrology.md B.12, (B32)). Tables and config as there.
// Gives pivot_yz_mm, pivot_xz_mm or pivot_xy_mm, where the axis passes the plane across its machine axis at along_mm
// (also), where the other axis is, and lean_yz_rad (xz, xy), by which the axis leans in that plane as it goes along.
// Two tilts need two angles of the other axis, three tilts one. Refuses: missing-key, bad-axis, tilt-span-too-small (20
// degrees), arm-too-short (5 sigma), ill-conditioned (a lean that a reading 1 um off changes by more than 0.2 mrad),
// and what leastSquares refuses.
Outcome<Result, Refusal> solveTablePivot3d(const Dataset& dataset);
Outcome<Result, Refusal> solveHeadPivot3d(const Dataset& dataset);

extern const Method kTablePivot3d;
extern const Method kHeadPivot3d;

}  // namespace probebox::metrology
