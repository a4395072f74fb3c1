#pragma once
#include "firmware/procedure/plan/finished_run.hpp"

namespace probebox::procedure {

// Builds a case of `joint` (docs/metrology.md G): table readings with a row for each touch, the touches themselves, and
// of each screw whose extension has changed enough its description and its gain in use. Positions along those axes are
// as the encoders show them, along the others less the screw's growth. Refuses what the computation of the points does.
RunDataset shiftDataset(const FinishedRun& run);

}  // namespace probebox::procedure
