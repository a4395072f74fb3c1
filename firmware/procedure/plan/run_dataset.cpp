#include "firmware/procedure/plan/run_dataset.hpp"

namespace probebox::procedure {

RunDataset runDataset(const LiveMethod& method, const capture::Recording& recording, const capture::Scales& scales,
                      const Facts& facts) {
  return method.dataset({method, recording, scales, facts});
}

std::optional<Solved> nextLoop(const LiveMethod& method, const capture::Recording& recording,
                               const capture::Scales& scales, const Facts& facts, const RunDataset& measured) {
  if (method.loops.next == nullptr || measured.refusal) return std::nullopt;
  return method.loops.next({method, recording, scales, facts}, measured);
}

}  // namespace probebox::procedure
