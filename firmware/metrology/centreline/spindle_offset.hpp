#pragma once
#include "firmware/metrology/dataset/dataset.hpp"
#include "firmware/metrology/dataset/method.hpp"
#include "firmware/metrology/dataset/result.hpp"
#include "protocol/units/outcome.hpp"

namespace probebox::metrology {

// Method "spindle-offset-four": C axis minus spindle axis from readings with spindle and C turned together, usually at
// 0, 90, 180 and 270 degrees (CN101976057 equations 1a, 1b; docs/metrology.md B.4). Least squares of all coordinates
// (B4); the source's half sums (B9) are the same for half of the data. Table readings{A_rad,C_rad,x_mm,y_mm}, with stop
// too (kStop). Config: sigma_mm, sigma_C_rad, A_sense, C_sense. Gives offset_C_minus_A_mm. Refuses: c-not-turned,
// spindle-not-turned, and what fitBall refuses.
Outcome<Result, Refusal> solveSpindleOffsetFour(const Dataset& dataset);

// Method "spindle-offset-2x2": the same from readings with spindle and C turned independently, usually each at 0 and
// 180 degrees, and the stylus' offset from the spindle axis (CN101976057 equations 2a, 2b; docs/metrology.md B.5:
// (B10), (B11), (B12)). Table and config as above. Gives offset_C_minus_A_mm and stylus_offset_mm; also ball_offset_mm,
// and tip_to_C_mm, the tip with the spindle at zero relative to C (B12). Refuses also readings that turn the axes
// together only: dependent-angles.
Outcome<Result, Refusal> solveSpindleOffset2x2(const Dataset& dataset);

namespace quantity {

inline constexpr Quantity kOffsetCMinusA{.key = result_key::kOffsetCMinusA,
                                         .about = "position of the C axis minus that of the spindle axis, x y",
                                         .kind = QuantityKind::offset,
                                         .axes = "XY"};

}  // namespace quantity

extern const Method kSpindleOffset2x2;
extern const Method kSpindleOffsetFour;

}  // namespace probebox::metrology
