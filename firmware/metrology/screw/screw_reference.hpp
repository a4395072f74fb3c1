#pragma once
#include "firmware/metrology/dataset/dataset.hpp"
#include "firmware/metrology/dataset/method.hpp"
#include "firmware/metrology/dataset/result.hpp"
#include "protocol/units/outcome.hpp"

namespace probebox::metrology {

// Method "screw-reference": reading of a ball screw's extension sensor that means no extension (CN101394969, (D1a),
// docs/metrology.md D7). Table at_rest{t_s,phi_rad,sensor_um}: readings of the cold screw at rest; table
// sector_table{sector,T_um} from screw-calibration, with sd_T_um, or sd_face_um where there is none. Config:
// drift_limit_um_s (default 0.002), resolution_um (default: the smallest difference between the readings). axis: of the
// screw (X, Y, Z). Gives reference_um, at the mean time and without the error of the face, and drift_um_s. Refuses:
// not-steady, too-few-samples (10, and as many as the drift limit needs), constant-sensor, time-not-rising,
// bad-sectors, missing-key, and what linearLeastSquares refuses.
Outcome<Result, Refusal> solveScrewReference(const Dataset& dataset);

namespace quantity {

inline constexpr Quantity kColdReading{.key = result_key::kColdReading,
                                       .about = "reading that means no extension (D1a)"};

}  // namespace quantity

extern const Method kScrewReference;

}  // namespace probebox::metrology
