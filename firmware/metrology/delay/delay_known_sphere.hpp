#pragma once
#include "firmware/metrology/dataset/dataset.hpp"
#include "firmware/metrology/dataset/method.hpp"
#include "firmware/metrology/dataset/result.hpp"
#include "protocol/units/outcome.hpp"

namespace probebox::metrology {

// Method "delay-known-sphere": system delay tau = tau_machine - tau_probe (A1) from touches of a datum sphere of known
// size; one speed is enough (CN101622513, docs/metrology.md A.4). Fits (A12) with R known, starting from (A9). Tables
// machine, probe, touches. Config: effective_diameter_mm (sphere and stylus ball); feature (external, internal);
// previous_tau_s. Gives tau_s, centre_mm, gain_matrix (the last two where the touches span space). Refuses what
// TouchDelay refuses.
Outcome<Result, Refusal> solveDelayKnownSphere(const Dataset& dataset);

extern const Method kDelayKnownSphere;

}  // namespace probebox::metrology
