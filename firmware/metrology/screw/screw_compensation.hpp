#pragma once
#include "firmware/metrology/dataset/dataset.hpp"
#include "firmware/metrology/dataset/method.hpp"
#include "firmware/metrology/dataset/result.hpp"
#include "protocol/units/outcome.hpp"

namespace probebox::metrology {

// Method "screw-compensation": correction to add to the position for a heated screw, row by row (CN101394969,
// docs/metrology.md D1, D3, D5, D6). Table cycle{x_mm,phi_rad,rpm,sensor_um}; table sector_table{sector,T_um} from
// screw-calibration. Config: screw_length_mm, orgoff_mm, K, threshold_rpm; axis_reversed; reference_um (the
// sensor's reading of the cold screw, default 0); extension_min_um, extension_max_um; sigma_um, of one reading of the
// sensor. Rows are single readings, so (D5) is the plain threshold. Gives comp_um, one per row; sd only with sigma_um.
// Refuses: bad-sectors (not each of 0 to n - 1 once), outside-screw, extension-out-of-limits, bad-config (a negative
// speed limit).
Outcome<Result, Refusal> solveScrewCompensation(const Dataset& dataset);

namespace quantity {

inline constexpr Quantity kScrewCorrections{.key = "comp_um",
                                            .about = "correction to add to the position, one per row of cycle"};

}  // namespace quantity

extern const Method kScrewCompensation;

}  // namespace probebox::metrology
