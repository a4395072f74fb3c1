#pragma once
#include "firmware/metrology/dataset/dataset.hpp"
#include "firmware/metrology/dataset/method.hpp"
#include "firmware/metrology/dataset/result.hpp"
#include "protocol/units/outcome.hpp"

namespace probebox::metrology {

// Method "delay-per-axis": the system delay of each machine axis, T = diag(tau_x, tau_y, tau_z), from touches on both
// sides of a sphere along every axis, or at several speeds (CN101622513, docs/metrology.md A.6): (A12). Tables machine,
// probe, touches. Config: effective_diameter_mm (sphere and stylus ball; without it the speeds have to separate size
// and delay); feature (external, internal); previous_tau_axis_s.
// Gives tau_axis_s and centre_mm; also gain_matrix, and effective_diameter_mm when it is not given. Refuses what
// TouchDelay refuses; one-sided when an axis has no opposed touches.
Outcome<Result, Refusal> solveDelayPerAxis(const Dataset& dataset);

extern const Method kDelayPerAxis;

}  // namespace probebox::metrology
