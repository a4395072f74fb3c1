#pragma once
#include "firmware/capture/recording.hpp"
#include "firmware/capture/touch_dataset.hpp"
#include "firmware/procedure/dataset/measured_case.hpp"
#include "firmware/procedure/facts/facts.hpp"
#include "firmware/procedure/plan/method.hpp"

namespace probebox::procedure {

// What a run measured whose steps are holds, as its case. Table holds: of each the means of machine positions and
// sensors, with their sd; tables machine and probe have every row of them. sensor-head-calibration: moves, from the
// mean place of all. rotary-axis-errors: first, second and third, a ball being at machine position + tool vector + K^-1
// sensors ((E1), with the head's centre where all sensors read zero). Refusal: no-sensor-head (its calibration is no
// longer in force).
RunDataset holdsDataset(Method method, const capture::Recording& recording, const capture::Scales& scales,
                        const Facts& facts);

}  // namespace probebox::procedure
