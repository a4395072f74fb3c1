#pragma once
#include "firmware/metrology/dataset/dataset.hpp"
#include "firmware/metrology/dataset/method.hpp"
#include "firmware/metrology/dataset/result.hpp"
#include "protocol/units/outcome.hpp"

namespace probebox::metrology {

// Method "delay-cylinder": system delay tau = tau_machine - tau_probe (A1) from touches around a pin, or within a bore,
// of known diameter (CN101622513, docs/metrology.md A.6). Tables machine, probe, touches. Config: diameter_mm;
// stylus_ball_diameter_mm; feature: internal (a bore) or external (a pin), by default as the normals show;
// previous_tau_s. Gives tau_s. Refuses what TouchDelay refuses; not-on-feature (normals that do not lie in one plane);
// one-sided.
Outcome<Result, Refusal> solveDelayCylinder(const Dataset& dataset);

extern const Method kDelayCylinder;

}  // namespace probebox::metrology
