#pragma once
#include "firmware/capture/recording.hpp"
#include "firmware/capture/touch_dataset.hpp"
#include "firmware/procedure/dataset/measured_case.hpp"
#include "firmware/procedure/facts/facts.hpp"

namespace probebox::procedure {

// What a run of tool-assembly measured, as its case (CN103801980, docs/metrology.md C). The tool-setting device is the
// measuring unit: its middle, where machine.toml has it accepted, is the unit's reference B, and its half width the
// distance from B to the touched edge. A row of readings is a round: W0 from opposed faces, L0 from the top. The stores
// hold the holder's and the tool's length of machine.toml. The case also holds machine, touches, edges and contacts;
// the time of day (measured_at_s) is whoever solves it to add. Refusal: what roundsOf() refuses.
RunDataset assemblyDataset(const capture::Recording& recording, const capture::Scales& scales, const Facts& facts);

}  // namespace probebox::procedure
