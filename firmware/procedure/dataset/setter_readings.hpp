#pragma once
#include "firmware/capture/recording.hpp"
#include "firmware/capture/touch_dataset.hpp"
#include "firmware/procedure/dataset/measured_case.hpp"
#include "firmware/procedure/facts/facts.hpp"

namespace probebox::procedure {

// Builds the case of a tool-setter run. Each round is a row of readings: the machine position with the tip at the
// centre of the device (docs/metrology.md B.9). Opposed faces give X and Y; half width and, for the probe, the stylus
// radius are subtracted from the top. Refuses: no-delay; setter-width-wrong (the measured width differs from the stated
// one); what switchedTouches() refuses.
RunDataset setterDataset(const capture::Recording& recording, const capture::Scales& scales, const Facts& facts);

}  // namespace probebox::procedure
