#include "firmware/procedure/plan/run_dataset.hpp"

#include "firmware/metrology/dataset/method.hpp"

namespace probebox::procedure {
namespace {

// Adds the temperature that was stated for this run, of whatever method.
void addTemperature(RunDataset& run, const LiveMethod& method, const Facts& facts) {
  if (!facts.temperature_c) return;
  auto& config = run.dataset.config;
  config["temperature_c"] = *facts.temperature_c;
  if (method.solver == nullptr || !metrology::hasSize(*method.solver) || config.contains("expansion_per_k")) return;
  run.warnings.emplace_back(
      "the temperature is for the record: known sizes are used as at 20 degrees C, because their expansion is not "
      "described; for the datum sphere give [datum_sphere] expansion_per_k in machine.toml");
}

}  // namespace

RunDataset runDataset(const LiveMethod& method, const capture::Recording& recording, const capture::Scales& scales,
                      const Facts& facts) {
  RunDataset run = method.dataset({method, recording, scales, facts});
  addTemperature(run, method, facts);
  return run;
}

std::optional<Solved> nextLoop(const LiveMethod& method, const capture::Recording& recording,
                               const capture::Scales& scales, const Facts& facts, const RunDataset& measured) {
  if (method.loops.next == nullptr || measured.refusal) return std::nullopt;
  return method.loops.next({method, recording, scales, facts}, measured);
}

}  // namespace probebox::procedure
