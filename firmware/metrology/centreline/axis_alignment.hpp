#pragma once
#include "firmware/metrology/dataset/dataset.hpp"
#include "firmware/metrology/dataset/method.hpp"
#include "firmware/metrology/dataset/result.hpp"
#include "protocol/units/outcome.hpp"

namespace probebox::metrology {

// Method "c-axis-alignment": direction of the C axis against Z from balls that turn with it at two or more heights,
// each read as in spindle-offset-2x2 (CN101976057, docs/metrology.md B.6, (B14)). Table
// readings{z_mm,A_rad,C_rad,x_mm,y_mm}, with stop too (kStop). Config: sigma_mm, sigma_C_rad, A_sense, C_sense;
// heights, "rotating" (the balls are at different heights of the rotating part) or "slide" (one chuck, carried along Z:
// the slide's own error, under its own name). Gives C_tilt_rad or Z_slide_rad: displacement in x and y per unit of Z.
// Also centre_mm at mean_z_mm, and taper_on_diameter, 2 k. Refuses: span-too-small (10 mm), c-not-turned, and what
// fitBall refuses.
Outcome<Result, Refusal> solveCAxisAlignment(const Dataset& dataset);

// Method "a-axis-alignment": direction of the spindle axis against Z from a ball that is read with tips of two or more
// lengths, or with tip and shank, or from two balls of one holder (CN101976057, docs/metrology.md B.7, (B15), (B16)).
// Tables and config: readSpindleReadings; sigma_mm, sigma_C_rad, and sigma_shank_mm of one touch with the shank;
// tool_direction, 1 when the tool points along +Z from the spindle as the sources have it, -1 along -Z; C_tilt_rad, as
// c-axis-alignment gives it. Gives A_tilt_rad and, where C_tilt_rad is stated, A_minus_C_rad; by tool
// stylus_offset_of_tool_N_mm, unless spindle and C turned together (B11). Refuses: span-too-small (10 mm of length),
// spindle-not-turned, and what fitBall and readSpindleReadings refuse.
Outcome<Result, Refusal> solveAAxisAlignment(const Dataset& dataset);

namespace quantity {

inline constexpr Quantity kCTilt{.key = result_key::kCTilt,
                                 .about = "x and y of the C axis per mm of Z, with heights rotating",
                                 .kind = QuantityKind::lean,
                                 .axes = "XY",
                                 .most = kMostLean_rad};
inline constexpr Quantity kZSlide{.key = "Z_slide_rad",
                                  .about = "x and y of the slide per mm of Z, with heights slide",
                                  .kind = QuantityKind::lean,
                                  .axes = "XY",
                                  .most = kMostLean_rad};
inline constexpr Quantity kSpindleTilt{.key = result_key::kSpindleTilt,
                                       .about = "x and y of the spindle axis per mm of Z",
                                       .kind = QuantityKind::lean,
                                       .axes = "XY",
                                       .most = kMostLean_rad};

}  // namespace quantity

extern const Method kCAxisAlignment;
extern const Method kAAxisAlignment;

}  // namespace probebox::metrology
