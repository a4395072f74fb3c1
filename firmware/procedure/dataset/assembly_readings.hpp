#pragma once
#include "firmware/capture/recording.hpp"
#include "firmware/capture/touch_dataset.hpp"
#include "firmware/procedure/dataset/measured_case.hpp"
#include "firmware/procedure/facts/facts.hpp"

namespace probebox::procedure {

// Builds the case of a tool-assembly run (CN103801980, docs/metrology.md C). The tool-setting device is the measuring
// unit: its accepted centre in machine.toml is reference B, its half width the distance from B to the touched edge.
// Each round is a row of readings: W0 from opposed faces, L0 from the top. The stores hold the lengths of holder and
// tool from machine.toml. The caller adds measured_at_s. Refuses what roundsOf() refuses.
RunDataset assemblyDataset(const capture::Recording& recording, const capture::Scales& scales, const Facts& facts);

}  // namespace probebox::procedure
