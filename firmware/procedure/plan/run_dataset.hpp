#pragma once
#include <optional>

#include "firmware/procedure/plan/finished_run.hpp"
#include "firmware/procedure/plan/live_method.hpp"
#include "protocol/events/event.hpp"

namespace probebox::procedure {

RunDataset runDataset(const LiveMethod& method, const capture::Recording& recording, const capture::Scales& scales,
                      const Facts& facts);

// Computes how a run continues, for methods whose later steps follow from earlier ones: the answer that adds steps,
// without run number and stamp. nullopt when the run can be solved.
std::optional<Solved> nextLoop(const LiveMethod& method, const capture::Recording& recording,
                               const capture::Scales& scales, const Facts& facts, const RunDataset& measured);

}  // namespace probebox::procedure
