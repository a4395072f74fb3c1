#pragma once
#include "firmware/metrology/dataset/dataset.hpp"
#include "firmware/metrology/dataset/method.hpp"
#include "firmware/metrology/dataset/result.hpp"
#include "protocol/units/outcome.hpp"

namespace probebox::metrology {

// Method "delay-stepped-scan": system delay tau = tau_machine - tau_probe (A1) from scans of a sphere's equator whose
// commanded radius steps between two values, over arcs of different lengths (CN101622513, docs/metrology.md A.7). Fits
// (A14) by the instrumental step (A17), starting from (A13). Tables machine `scan,t_s,x_mm,y_mm,z_mm`, probe
// `scan,t_s,a,b,c`, scans `scan,speed_mm_s`. Config: centre_mm (may be off by 0.2 mm), search_window_s; gain_matrix;
// effective_radius_mm, r1_mm, r2_mm, arcs_rad, centre_is_approximate (for the record); previous_tau_s; probe_kind
// (deflection, distance: then table probe has the column distance_mm). Gives tau_s. Refuses what checkedTable and
// matchWaveforms refuse; unknown-scan, time-not-rising, too-few-samples, duplicated-reading, contact-lost,
// constant-radius, rival-peak, no-peak, window-too-small, window-too-large, centre-error, residual-too-large. Gaps are
// omitted.
Outcome<Result, Refusal> solveDelaySteppedScan(const Dataset& dataset);

extern const Method kDelaySteppedScan;

}  // namespace probebox::metrology
