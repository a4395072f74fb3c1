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

namespace quantity {

inline constexpr std::string_view kTermNames[]{"sin B", "L sin B", "1 - cos B", "L (1 - cos B)"};

inline std::string queryPart(std::size_t component) {
  return "error " + axisName(component % 3) + " at query " + std::to_string(component / 3 + 1);
}
inline std::string termPart(std::size_t component) {
  return component < 12 ? axisName(component / 4) + ", factor of " + std::string{kTermNames[component % 4]}
                        : std::string{};
}
inline std::string leftPart(std::size_t component) {
  const std::string stop = "stop " + std::to_string(component / 4 + 1);
  return component % 4 == 0 ? "B of " + stop : "left " + axisName(component % 4 - 1) + " at " + stop;
}

inline constexpr QuantityColumn kQueryColumns[]{{"X", "um", 1e3}, {"Y", "um", 1e3}, {"Z", "um", 1e3}};
// A term that grows with the tool's length L is in mm per mm.
inline constexpr QuantityColumn kTermColumns[]{
    {kTermNames[0], "um", 1e3}, {kTermNames[1], "um/m", 1e6}, {kTermNames[2], "um", 1e3}, {kTermNames[3], "um/m", 1e6}};
inline constexpr QuantityColumn kLeftColumns[]{{"B", "deg", 1.0}, {"X", "um", 1e3}, {"Y", "um", 1e3}, {"Z", "um", 1e3}};

inline constexpr Quantity kErrorAtQueries{.key = "error_at_queries_mm",
                                          .about = "error at the tip, a row a query, x y z",
                                          .kind = QuantityKind::error,
                                          .part_name = queryPart,
                                          .title = "error of the head at the queried angles",
                                          .columns = kQueryColumns,
                                          .compared = Compared::never};
inline constexpr Quantity kQueryB{.key = "query_B_deg"};
inline constexpr Quantity kQueryLength{.key = "query_L_mm"};
inline constexpr Quantity kSwivelTerms{.key = result_key::kSwivelTerms,
                                       .part_name = termPart,
                                       .title = "terms of the error of the head, L the length of the tool",
                                       .rows = kAxisRows,
                                       .columns = kTermColumns,
                                       .compared = Compared::always};
inline constexpr Quantity kLeftByAngle{
    .key = result_key::kLeftByAngle, .part_name = leftPart, .title = "left at each angle", .columns = kLeftColumns};

}  // namespace quantity

extern const Method kSwivelError;

}  // namespace probebox::metrology
