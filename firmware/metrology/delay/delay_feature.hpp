#pragma once
#include "firmware/metrology/dataset/dataset.hpp"
#include "firmware/metrology/dataset/method.hpp"
#include "firmware/metrology/dataset/result.hpp"
#include "protocol/units/outcome.hpp"

namespace probebox::metrology {

// Method "delay-feature": system delay tau = tau_machine - tau_probe (A1) from touches of a sphere, cylinder or bore,
// pair of faces, box, or one plane, on which the work piece may move (CN101622513, docs/metrology.md A.6, A.10): (A12)
// with the signed distance to the feature in place of |P - c| - R. Tables machine, probe, touches; article where the
// workpiece moves too. Config: shape (needed); axis_direction of a cylinder; size_mm, effective: diameter, or distance
// of the faces; size_axis_mm of a box; delays (common, each-axis); article_has_own_delay; threshold_mm with
// gain_matrix; previous_tau_s. Gives tau_s or tau_axis_s; tau_article_s; size_mm where it is not known; also centre_mm.
// Refuses what surfacePoints and leastSquares refuse; bad-config; single-speed, speeds-too-close (a size or plane that
// is not known); one-sided; not-on-feature (a normal that the shape does not have); residual-too-large.
Outcome<Result, Refusal> solveDelayFeature(const Dataset& dataset);

extern const Method kDelayFeature;

}  // namespace probebox::metrology
