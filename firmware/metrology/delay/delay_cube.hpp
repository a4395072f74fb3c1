#pragma once
#include "firmware/metrology/dataset/dataset.hpp"
#include "firmware/metrology/dataset/method.hpp"
#include "firmware/metrology/dataset/result.hpp"
#include "protocol/units/outcome.hpp"

namespace probebox::metrology {

// Method "delay-cube": system delay tau = tau_machine - tau_probe (A1) from touches of the faces of a block with known
// edges along the axes (CN101622513, docs/metrology.md A.6). Tables machine, probe, touches. Config: edges_mm;
// stylus_ball_diameter_mm; previous_tau_s. Gives tau_s. Refuses what TouchDelay refuses; not-on-feature (a normal along
// no axis).
Outcome<Result, Refusal> solveDelayCube(const Dataset& dataset);

extern const Method kDelayCube;

}  // namespace probebox::metrology
