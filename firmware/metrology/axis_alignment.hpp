#pragma once
#include "firmware/metrology/dataset.hpp"
#include "firmware/metrology/result.hpp"
#include "protocol/units/outcome.hpp"

namespace probebox::metrology {

// Method "c-axis-alignment": direction of the C axis against Z from balls that turn with it at two or more heights,
// each read as in spindle-offset-2x2 (CN101976057, docs/metrology.md B.6, (B14)). Table
// readings{z_mm,A_rad,C_rad,x_mm,y_mm}. Config: sigma_mm, A_sense, C_sense. Gives C_tilt_rad: the axis' displacement in
// x and y over a unit of Z. Also centre_mm at mean_z_mm, and taper_on_diameter, 2 k. Heights must lie on the rotating
// part: with a chuck that the slide carries along Z this is the slide's own error. Refuses: span-too-small (10 mm),
// c-not-turned, and what fitBall refuses.
Outcome<Result, Refusal> solveCAxisAlignment(const Dataset& dataset);

// Method "a-axis-alignment": direction of the spindle axis against Z from one ball that is read with tips of two or
// more lengths (CN101976057, docs/metrology.md B.7, (B15); a shank that touches from opposite sides serves as a tip,
// (B16)). Table readings{tip_length_mm,A_rad,C_rad,x_mm,y_mm}. Config: sigma_mm, A_sense, C_sense; tool_direction, 1
// when the tool points along +Z from the spindle as the sources have it, -1 along -Z. Gives A_tilt_rad. Refuses:
// span-too-small (10 mm of length), spindle-not-turned, and what fitBall refuses.
Outcome<Result, Refusal> solveAAxisAlignment(const Dataset& dataset);

}  // namespace probebox::metrology
