#pragma once
#include "firmware/metrology/dataset/dataset.hpp"
#include "firmware/metrology/dataset/method.hpp"
#include "firmware/metrology/dataset/result.hpp"
#include "protocol/units/outcome.hpp"

namespace probebox::metrology {

// Method "delay-contour": system delay tau = tau_machine - tau_probe (A1) from scans along any path whose distance from
// a known feature changes (CN101622513, docs/metrology.md A.7b, (A22)). Tables machine `scan,t_s,x_mm,y_mm,z_mm`, probe
// `scan,t_s,a,b,c` (or `scan,t_s,distance_mm`), scans `scan,speed_mm_s`. Config: shape, centre_mm, axis_direction,
// size_axis_mm and feature as featureDistance has them; search_window_s (needed); gain_matrix, previous_tau_s,
// probe_kind (deflection, distance). Gives tau_s. Refuses what featureDistance, searchWindow and matchScans refuse.
Outcome<Result, Refusal> solveDelayContour(const Dataset& dataset);

extern const Method kDelayContour;

}  // namespace probebox::metrology
