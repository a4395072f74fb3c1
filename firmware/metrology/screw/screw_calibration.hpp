#pragma once
#include "firmware/metrology/dataset/dataset.hpp"
#include "firmware/metrology/dataset/method.hpp"
#include "firmware/metrology/dataset/result.hpp"
#include "protocol/units/outcome.hpp"

namespace probebox::metrology {

// Method "screw-calibration": gain and face table of a ball screw's extension sensor (CN101394969, docs/metrology.md
// D2, D3, D4). Table gain_cal{x_mm,ext_um,error_um}: true position errors, measured at several positions and
// extensions; K by least squares through zero (D2). Table sector_cal{t_s,phi_rad,sensor_um}: three or more slow turns,
// thermally steady; the mean of each sector, fitted together with a drift and the slope inside the sector, so that the
// places of the samples in a sector do not matter (D4). Config: screw_length_mm, orgoff_mm, sectors; axis_reversed;
// drift_limit_um_s (default 0.1). Without gain_cal the key K must state the gain that stays in use: only the face is
// then measured, and the result has no K. axis: of the screw (X, Y, Z). Gives K, sector_table_um (sum 0), drift_um_s;
// sd from the residuals of each table. rms, dof and condition are those of the face. Refuses: extension-span-too-small
// (5 um), bad-sectors, empty-sector, too-few-samples (10 a sector), too-few-turns (3), not-steady, and what
// linearLeastSquares refuses.
Outcome<Result, Refusal> solveScrewCalibration(const Dataset& dataset);

namespace quantity {

inline std::string sectorPart(std::size_t component) {
  return "sector " + std::to_string(component);
}

// About 1: the nut is off by what the screw stretches.
inline constexpr Quantity kScrewGain{
    .key = result_key::kScrewGain, .about = "gain (D2), unless it is stated", .most = 10};
inline constexpr Quantity kSectorTable{
    .key = "sector_table_um", .about = "face table (D3), sum 0", .part_name = sectorPart};
inline constexpr Quantity kSensorDrift{
    .key = "drift_um_s", .about = "drift of the sensor during sector_cal", .compared = Compared::never};

}  // namespace quantity

extern const Method kScrewCalibration;

}  // namespace probebox::metrology
