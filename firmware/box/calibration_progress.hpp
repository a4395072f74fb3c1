#pragma once
#include "firmware/procedure/plan/procedure.hpp"
#include "firmware/published/snapshot.hpp"

namespace probebox::box {

// What a controller is shown of a run: how far it is, and the step that it has to do next.
published::CalibrationProgress calibrationOf(const procedure::Progress& progress, const procedure::Plan& plan,
                                             const published::DelayInForce& delay);

}  // namespace probebox::box
