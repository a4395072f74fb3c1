#pragma once
#include "firmware/metrology/dataset/dataset.hpp"
#include "firmware/metrology/dataset/method.hpp"
#include "firmware/metrology/dataset/result.hpp"
#include "protocol/units/outcome.hpp"

namespace probebox::metrology {

// Method "pre-travel": pre-travel of a touch-trigger probe by direction, from touches all over a sphere of known size
// (A23). A reading is the mean of the positions at contact and release, so the trigger's own delay is not in it. Tables
// machine, touches, edges. Config: effective_diameter_mm (sphere and stylus ball), previous_tau_axis_s, sigma_mm. Gives
// pre_travel_mm and centre_mm; also switch_late_s. Refuses: what switchedTouches and leastSquares refuse,
// few-directions.
Outcome<Result, Refusal> solvePreTravel(const Dataset& dataset);

extern const Method kPreTravel;

}  // namespace probebox::metrology
