#pragma once
#include "firmware/metrology/dataset/dataset.hpp"
#include "firmware/metrology/dataset/method.hpp"
#include "firmware/metrology/dataset/result.hpp"
#include "protocol/units/outcome.hpp"

namespace probebox::metrology {

// Method "delay-non-normal": system delay tau = tau_machine - tau_probe (A1) from touches of a sphere whose drives lie
// off the normal by up to 60 degrees (CN101622513, docs/metrology.md A.6): (A12) with the velocity as a vector is exact
// as long as the tip does not slide. Tables machine, probe, touches. Config: effective_diameter_mm (sphere and stylus
// ball; without it the speeds have to separate size and delay); feature (external, internal); previous_tau_s.
// Gives tau_s and centre_mm; also gain_matrix, and effective_diameter_mm when it is not given. Refuses what TouchDelay
// refuses, and tip-slip: deflections that one gain matrix cannot explain.
Outcome<Result, Refusal> solveDelayNonNormal(const Dataset& dataset);

extern const Method kDelayNonNormal;

}  // namespace probebox::metrology
