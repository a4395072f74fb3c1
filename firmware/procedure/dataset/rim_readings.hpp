#pragma once
#include <optional>
#include <vector>

#include "firmware/capture/recording.hpp"
#include "firmware/metrology/dataset/dataset.hpp"
#include "firmware/procedure/dataset/ball_reading.hpp"
#include "firmware/procedure/dataset/measured_case.hpp"
#include "firmware/procedure/facts/facts.hpp"
#include "firmware/procedure/plan/step.hpp"

// centreline-by-steps: a ball on the rim of a large part, loop by loop (docs/metrology.md B.11).
namespace probebox::procedure {

// Tables readings and stylus, and the keys.
void addRimSteps(metrology::Dataset& dataset, const std::vector<Reading>& readings, const Facts& facts);

// Computes how a run continues: with a reading at zero when the last loop is level or the loops are used up, else with
// one more loop from the corrected zero (B26). nullopt when all is done, or when no further step follows: the run can
// be solved.
std::optional<RimLoops> nextLoops(Method method, const capture::Recording& recording, const RunDataset& measured);

}  // namespace probebox::procedure
