#pragma once
#include "firmware/capture/recording.hpp"
#include "firmware/capture/touch_dataset.hpp"
#include "firmware/procedure/dataset/measured_case.hpp"
#include "firmware/procedure/facts/facts.hpp"

namespace probebox::procedure {

// What a run of tool-setter measured, as its case. A row of readings is a round of touches: where the machine stands
// when the tip is at the middle of the device (docs/metrology.md B.9). Opposed faces give X and Y; half width and, with
// the probe, the radius of the stylus ball are taken off the top. The case also holds machine, touches, edges and
// contacts. Refusal: no-delay; setter-width-wrong (the probe finds another width than is stated); what
// switchedTouches() refuses.
RunDataset setterDataset(const capture::Recording& recording, const capture::Scales& scales, const Facts& facts);

}  // namespace probebox::procedure
