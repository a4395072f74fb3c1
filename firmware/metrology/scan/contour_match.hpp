#pragma once
#include <span>
#include <string_view>

#include "firmware/metrology/dataset/dataset.hpp"
#include "firmware/metrology/dataset/result.hpp"
#include "firmware/metrology/scan/contour_scan.hpp"
#include "protocol/units/outcome.hpp"

namespace probebox::metrology {

// Fits the delay of distance + g deflection over all scans of a dataset (CN101622513, docs/metrology.md (A13), (A14),
// (A22)), for a deflecting or a distance probe. Gives tau_s. Refuses what
// readScans, coarseDelay and matchWaveforms refuse; bad-config; centre-error (feature displaced by more than 0.2 mm);
// residual-too-large. Gaps are omitted.
Outcome<Result, Refusal> matchScans(const Dataset& dataset, const ScanQuestion& question);

}  // namespace probebox::metrology
