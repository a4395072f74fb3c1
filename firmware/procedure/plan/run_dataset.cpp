#include "firmware/procedure/plan/run_dataset.hpp"

#include "firmware/metrology/dataset/conditions.hpp"
#include "firmware/metrology/dataset/read_times.hpp"
#include "firmware/metrology/uncertainty/machine_errors.hpp"

namespace probebox::procedure {
namespace {

// Adds the temperature that was stated for this run, of whatever method.
void addTemperature(RunDataset& run, const Facts& facts) {
  if (!facts.temperature_c) return;
  auto& config = run.dataset.config;
  config["temperature_c"] = *facts.temperature_c;
  if (!config.contains("effective_diameter_mm") || config.contains("expansion_per_k")) return;
  run.warnings.emplace_back(
      "the temperature is for the record: the datum sphere is used as at 20 degrees C, because its expansion is not "
      "described; give [datum_sphere] expansion_per_k in machine.toml");
}

// Adds what is known of the machine's own errors, and for its drift the mean time from one reading to the next, of
// a method without readings from one touch to the next.
void addAccuracy(metrology::Dataset& dataset, const LiveMethod& method, const capture::Recording& recording,
                 const Facts& facts) {
  if (facts.accuracy) {
    for (const auto& error : kMachineErrors) dataset.config[error.key] = *facts.accuracy.*error.member;
  }
  for (const auto& [error, value] : facts.measured_errors) dataset.config[error->key] = value;
  if (facts.machine_check_result != 0)
    dataset.config[std::string{metrology::kMachineCheckKey}] = static_cast<double>(facts.machine_check_result);
  const auto touches = recording.touches();
  const std::size_t places = metrology::placesRead(dataset, *method.solver);
  const std::size_t readings = places > 0 ? places : touches.size();
  if (touches.empty() || readings < 2) return;
  const auto first = recording.machineRows(touches.front()), last = recording.machineRows(touches.back());
  if (first.empty() || last.empty()) return;
  const double each_s = toSeconds(last.back().at - first.front().at) / static_cast<double>(readings - 1);
  if (each_s > 0) dataset.config[std::string{metrology::kReadingTime}] = each_s;
}

}  // namespace

RunDataset runDataset(const LiveMethod& method, const capture::Recording& recording, const capture::Scales& scales,
                      const Facts& facts) {
  RunDataset run = method.dataset({method, recording, scales, facts});
  addTemperature(run, facts);
  addAccuracy(run.dataset, method, recording, facts);
  return run;
}

std::optional<Solved> nextLoop(const LiveMethod& method, const capture::Recording& recording,
                               const capture::Scales& scales, const Facts& facts, const RunDataset& measured) {
  if (method.loops.next == nullptr || measured.refusal) return std::nullopt;
  return method.loops.next({method, recording, scales, facts}, measured);
}

}  // namespace probebox::procedure
