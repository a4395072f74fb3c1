#pragma once
#include "firmware/capture/touch_dataset.hpp"
#include "firmware/procedure/dataset/measured_case.hpp"
#include "firmware/procedure/facts/facts.hpp"
#include "firmware/procedure/plan/method.hpp"

namespace probebox::procedure {

RunDataset runDataset(Method method, const capture::Recording& recording, const capture::Scales& scales,
                      const Facts& facts);

}  // namespace probebox::procedure
