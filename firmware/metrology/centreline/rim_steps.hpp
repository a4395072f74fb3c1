#pragma once
#include "firmware/metrology/dataset/dataset.hpp"
#include "firmware/metrology/dataset/method.hpp"
#include "firmware/metrology/dataset/result.hpp"
#include "protocol/units/outcome.hpp"

namespace probebox::metrology {

// Default of level_limit_mm: readings at +theta and -theta whose y differ by less are level.
inline constexpr double kUsualLevelLimit_mm = 0.01;

// Method "centreline-by-steps": centre of a large chuck by the steps of the source, with one weighted fit of all
// readings for comparison (CN101976057 equations 7 to 11, docs/metrology.md B.11). Tables: readings{loop,
// C_rad_clockwise_from_plus_y,x_mm,y_mm}, C counted from the zero that was in force in that loop (1, 2, ..); stylus
// {A_rad,x_mm,y_mm} of step 1 if the stylus' offset is to be removed: the two coordinates across the spindle, one of
// them z_mm if the stylus lies in the x-y plane (readings may then have z_mm too); contacts{C1_rad,C2_rad} of
// step 2, which moved the zero of C before the first loop. Each loop has a reading at +theta and one at -theta; the
// last one also one at 0. Where the two are less than level_limit_mm apart in y (default 0.01) the loops end, else the
// zero moves by (B26) to the next loop. Config: sigma_mm, sigma_C_rad, sigma_contact_rad, level_limit_mm;
// trust_C_angles (default true). Gives centre_mm, radius_mm: of the fit with known angles, or of the steps where the
// angles of C are not to be trusted; also steps_centre_mm, steps_radius_mm, fit_centre_mm, C_shift_rad (of all loops
// and contacts), contact_shift_rad (of the contacts alone, with its sd), stylus_offset_mm (x and y, or x, y and z),
// height_mm of readings with z_mm. Refuses: bad-config, bad-loop, missing-step, arc-too-short (theta under 15 degrees),
// not-level (the last loop), too-many-loops (5), level-readings (y at 0 as at theta), not-opposite (stylus),
// steps-disagree (steps against the fit, or their two radii, by more than 4 sd), and what fitRotation refuses.
Outcome<Result, Refusal> solveCentrelineBySteps(const Dataset& dataset);

extern const Method kCentrelineBySteps;

}  // namespace probebox::metrology
