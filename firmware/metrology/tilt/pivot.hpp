#pragma once
#include "firmware/metrology/dataset/dataset.hpp"
#include "firmware/metrology/dataset/method.hpp"
#include "firmware/metrology/dataset/result.hpp"
#include "protocol/units/outcome.hpp"

namespace probebox::metrology {

// Method "table-pivot": position of a tilting table's axis in the plane across it (CN101976057 equations 13a, 13b;
// docs/metrology.md B.12, (B29)). Table readings{tilt_deg,C_deg,x_mm,y_mm,z_mm}: centres of one ball, at two or more
// tilts for each angle of C that is used. Config: tilt_axis, sigma_mm, sigma_angle_rad (of a stop of the axis). Gives
// pivot_yz_mm for a tilt about X, pivot_xz_mm about Y, pivot_xy_mm about Z, where the tilt axis, whose skew is fitted
// too, passes the C axis: at along_mm (also); with two angles of C or fewer, at the mean of the points. At tilts of -90
// and 0 the source's equations (B28) are evaluated as a check. Refuses: missing-key, bad-axis,
// tilt-span-too-small (20 degrees), arm-too-short (5 sigma), pivot-check-disagrees, readings-contradict (checkSkew),
// and what linearLeastSquares refuses.
Outcome<Result, Refusal> solveTablePivot(const Dataset& dataset);

// Method "head-pivot": position of a swivelling head's axis relative to the moving reference (CN101976057 equation 12;
// docs/metrology.md (B30)): the same fit with the signs turned, since the ball stands still. Table
// readings{B_deg,A_deg,x_mm,y_mm,z_mm}: machine positions with the stylus at the ball, at two or more B for each angle
// of the spindle. Config: ball_mm (where the ball is), swivel_axis, sigma_mm, sigma_angle_rad. Gives pivot_<plane>_mm.
// Refuses as above.
Outcome<Result, Refusal> solveHeadPivot(const Dataset& dataset);

namespace quantity {

// Of what is read while an axis tilts: a ball 200 mm from the pivot moves by 11 mm in inches.
inline constexpr UsualSize kUsualWay{.least_mm = 12, .most_mm = 20000, .of_readings = true};
inline constexpr Quantity kPivotXz{.key = result_key::kPivotXz, .axes = "XZ", .name = "pivot", .usual = kUsualWay};
inline constexpr Quantity kPivotYz{.key = result_key::kPivotYz, .axes = "YZ", .name = "pivot", .usual = kUsualWay};
inline constexpr Quantity kPivotXy{.key = result_key::kPivotXy, .axes = "XY", .name = "pivot", .usual = kUsualWay};
// Where the pivot is along the axis itself.
inline constexpr Quantity kAlong{.key = result_key::kAlong};
inline constexpr Quantity kPivots[]{kPivotXz, kPivotYz, kPivotXy, kAlong};

}  // namespace quantity

extern const Method kTablePivot;
extern const Method kHeadPivot;

}  // namespace probebox::metrology
