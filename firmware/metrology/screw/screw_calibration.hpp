#pragma once
#include "firmware/metrology/dataset/dataset.hpp"
#include "firmware/metrology/dataset/method.hpp"
#include "firmware/metrology/dataset/result.hpp"
#include "protocol/units/outcome.hpp"

namespace probebox::metrology {

// Method "screw-calibration": gain and face table of a ball screw's extension sensor (CN101394969, docs/metrology.md
// D2, D3, D4). Table gain_cal{x_mm,ext_um,error_um}: true position errors, measured at several positions and
// extensions; K by least squares through zero (D2). Table sector_cal{t_s,phi_rad,sensor_um}: three or more slow turns,
// thermally steady; the mean of each sector, beside a drift and the slope inside the sector, so that it does not matter
// where in a sector the samples lie (D4). Config: screw_length_mm, orgoff_mm, sectors; axis_reversed; drift_limit_um_s
// (default 0.1). Where there is no gain_cal, the key K must say which gain stays: then the face alone is measured, and
// the result has no K. axis: whose screw (X, Y, Z), for the box. Gives K, sector_table_um (sum 0), drift_um_s; sd from
// the residuals of each table. rms, dof and condition are those of the face. Refuses: extension-span-too-small (5 um),
// bad-sectors, empty-sector, too-few-samples (10 a sector), too-few-turns (3), not-steady, and what linearLeastSquares
// refuses.
Outcome<Result, Refusal> solveScrewCalibration(const Dataset& dataset);

extern const Method kScrewCalibration;

}  // namespace probebox::metrology
