#pragma once
#include "firmware/capture/recording.hpp"
#include "firmware/capture/touch_dataset.hpp"
#include "firmware/procedure/dataset/measured_case.hpp"
#include "firmware/procedure/facts/facts.hpp"
#include "firmware/procedure/plan/method.hpp"

namespace probebox::procedure {

// Builds the case of a run whose steps are holds. Table holds: mean machine position and sensor readings of each hold
// with their sd; tables machine and probe keep every row. sensor-head-calibration: moves relative to their mean.
// rotary-axis-errors: first, second, third, with ball = machine position + tool vector + K^-1 sensors (E1). Refuses:
// no-sensor-head (its calibration is no longer in force).
RunDataset holdsDataset(Method method, const capture::Recording& recording, const capture::Scales& scales,
                        const Facts& facts);

}  // namespace probebox::procedure
