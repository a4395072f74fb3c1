#pragma once
#include "firmware/metrology/dataset/dataset.hpp"
#include "firmware/metrology/dataset/method.hpp"
#include "firmware/metrology/dataset/result.hpp"
#include "protocol/units/outcome.hpp"

namespace probebox::metrology {

// Method "swivel-error": E(B, L), error of the control about the tip of a tool of length L at a head angle B
// (CN101976057 equations 3 and 4, docs/metrology.md B.8). Table readings{B_deg,L_mm,x_mm,y_mm,z_mm}: reported centres
// of one ball; table queries{B_deg,L_mm}. If the shank of the tip's tool is the second length: shank{..,ux,uy,uz}, each
// row the mean of two touches from that side, with the spindle turned by 180 degrees between them (B16). A shank gives
// no information along the tool, where both lengths are taken as stated, and cannot contradict a rigid head.
// Config: swivel_axis, sigma_mm, sigma_along_mm (of a coordinate along the axis, if different), sigma_shank_mm (of a
// row of shank), model:
//   "rigid" (B20): small deviations of the gauge line and of the tool direction in the head, in the plane of the
//     swivel, and sin B, 1 - cos B along the axis
//   "free" (B21): sin B and 1 - cos B for every coordinate
//   "sine": the source's (B17)-(B19), right only if the 1 - cos B terms vanish
//   default: rigid, or free if two or more angles contradict rigid as chance does in at most 3 of 1000 runs
// One angle cannot separate sin B from 1 - cos B along the axis: rigid then answers sin B, and its sd allows for all of
// it being 1 - cos B. Corrections that the control adds for each length cancel. Centres of a touch-trigger probe have
// to be without its pre-travel: p0 - pz of it is taken for a length of the tool (A24). Gives error_at_queries_mm, one
// row per query; also query_B_deg, query_L_mm, model and recommended_model (0 sine, 1 rigid, 2 free); rms_sine_mm,
// rms_rigid_mm, rms_free_mm, the residual of a reading under each model; for rigid gauge_line_mm and
// tool_direction_rad, in the plane's order ((z, x) for Y); for live corrections (SwivelCorrection) swivel_terms_mm (for
// x, y, z the factors of sin B, L sin B, 1 - cos B, L (1 - cos B)) and left_by_angle_mm, rows B_deg, x, y, z. Refuses:
// missing-key, bad-config, bad-axis, length-span-too-small (10 mm), swivel-angle-too-small (|sin B| < 0.2), what
// linearLeastSquares refuses, and with a shank what readSwivelReadings refuses.
Outcome<Result, Refusal> solveSwivelError(const Dataset& dataset);

extern const Method kSwivelError;

}  // namespace probebox::metrology
