#pragma once
#include <Eigen/Core>
#include <string>
#include <string_view>

#include "firmware/metrology/dataset/dataset.hpp"
#include "firmware/metrology/dataset/method.hpp"
#include "firmware/metrology/dataset/result.hpp"
#include "firmware/metrology/live/rotary_chain.hpp"
#include "firmware/metrology/rotary/rotary_quantities.hpp"
#include "protocol/units/outcome.hpp"

namespace probebox::metrology {

// Method "rotary-axis-errors": the six errors of a rotary axis at each angle from the balls of a plate, read by an
// R-test sensor head (CN112247668, docs/metrology.md section E). Tables, all ball,x_mm,y_mm,z_mm: first, with phi_rad
// before it, the axis turned to phi, any balls; second, the axis at zero, linear axes only; third, the certificate, in
// the plate's own frame. Config: axis_point_mm, axis_direction, sigma_mm; axis, its letter.
// The plate's place comes from the second coordinates, and from the first ones at phi = 0 where they agree with them
// (E2, E3); then each angle is fitted by itself (E5), with the exact rotation. Gives six_errors, a row for each angle
// of first in rising order (also angle_rad); location_mm and tilt_rad (E7), with intercepts, when four or more angles
// are spread wider than 60 degrees, else a warning. sd holds the common uncertainty of the plate's place (E6). Refuses:
// missing-key, bad-config, missing-ball (not in third), duplicated-ball, too-few-balls, collinear, residual-too-large
// (5 sigma between second and third).
Outcome<Result, Refusal> solveRotaryAxisErrors(const Dataset& dataset);

// "deviation_XC_at_60_deg_mm": the key under which programs find one of the six errors of axis "C" at an angle.
std::string deviationKey(std::string_view axis, std::size_t error, double angle_rad);

extern const Method kRotaryAxisErrors;

}  // namespace probebox::metrology
