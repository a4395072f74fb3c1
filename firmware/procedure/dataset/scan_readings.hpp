#pragma once
#include "firmware/procedure/plan/finished_run.hpp"

namespace probebox::procedure {

// The case of a run of scans, with the tables of the delay methods that take scans. What was recorded at rest, before
// and behind the path, is left out. centre_mm: of the commanded path, as the machine's positions show it, which is
// where the control takes the middle of the sphere to be. gain_matrix: the described one times what the scans tell of
// it in their plane, because the deflection has to be known in all directions as well as in one. Runs in which nothing
// moved or touched keep the described gain; their solver refuses them.
RunDataset scanDataset(const FinishedRun& run);

}  // namespace probebox::procedure
