#pragma once
#include "firmware/procedure/plan/finished_run.hpp"

namespace probebox::procedure {

// The case of a run of scans, with the tables of the delay methods that take scans. Samples recorded at rest, before
// and after the path, are omitted. centre_mm: centre of the commanded path as the machine's positions show it, which is
// where the control assumes the centre of the sphere. gain_matrix: the described one, improved in the plane of the
// scans by scanGain(), because the deflection has to be known in all directions as well as in one. Runs in which
// nothing moved or touched keep the described gain; their solver refuses them.
RunDataset scanDataset(const FinishedRun& run);

}  // namespace probebox::procedure
