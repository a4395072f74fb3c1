#pragma once
#include "firmware/procedure/plan/procedure.hpp"
#include "protocol/state/snapshot.hpp"

namespace probebox::box {

// Returns the progress of a run as a controller reads it: how far it is, and the step to do next.
published::CalibrationProgress calibrationOf(const procedure::Progress& progress, const procedure::Plan& plan,
                                             const published::DelayInForce& delay);

}  // namespace probebox::box
