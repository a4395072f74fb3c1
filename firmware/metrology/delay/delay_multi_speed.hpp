#pragma once
#include "firmware/metrology/dataset/dataset.hpp"
#include "firmware/metrology/dataset/method.hpp"
#include "firmware/metrology/dataset/result.hpp"
#include "protocol/units/outcome.hpp"

namespace probebox::metrology {

// Method "delay-multi-speed": system delay tau = tau_machine - tau_probe (A1) and effective size from the same touches
// at two or more speeds, the size unknown (CN101622513, docs/metrology.md A.5). Every touch is reduced to its retract
// lines (A5)-(A7), then all touches are fitted together (A12), starting from (A10), with one gain matrix of the probe
// (A3). Tables machine, probe, touches. Config: effective_diameter_mm when a certificate gives it; feature
// (external, internal). Gives tau_s and effective_diameter_mm, and static_error_mm (measured minus known) when the size
// is known. sd from the pooled residuals of the samples, whose degrees of freedom are `dof`; widened when the touches
// scatter more than that. Refuses: what readTouches, fitRetract (when too few touches remain), refuseSpeeds and
// fitTouches refuse; clipped. A touch that is bad on its own is dropped by name, with a warning.
Outcome<Result, Refusal> solveDelayMultiSpeed(const Dataset& dataset);

extern const Method kDelayMultiSpeed;

}  // namespace probebox::metrology
