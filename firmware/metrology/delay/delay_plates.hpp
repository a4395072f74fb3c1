#pragma once
#include "firmware/metrology/dataset/dataset.hpp"
#include "firmware/metrology/dataset/method.hpp"
#include "firmware/metrology/dataset/result.hpp"
#include "protocol/units/outcome.hpp"

namespace probebox::metrology {

// Method "delay-plates": system delay tau = tau_machine - tau_probe (A1) from touches of two parallel faces whose
// distance is known (CN101622513, docs/metrology.md A.4). Fits (A12) with R known, in one dimension, from (A9).
// Tables machine, probe, touches. Config: gap_mm, the distance of the faces; stylus_ball_diameter_mm; feature: internal
// (a gap) or external (a block), by default as the normals show; previous_tau_s.
// Gives tau_s. Refuses what TouchDelay refuses, and not-opposed: normals that do not lie on one line.
Outcome<Result, Refusal> solveDelayPlates(const Dataset& dataset);

extern const Method kDelayPlates;

}  // namespace probebox::metrology
