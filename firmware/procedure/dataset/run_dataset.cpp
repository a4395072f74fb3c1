#include "firmware/procedure/dataset/run_dataset.hpp"

#include <algorithm>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "firmware/metrology/selftest/selftest.hpp"
#include "firmware/procedure/dataset/assembly_readings.hpp"
#include "firmware/procedure/dataset/hold_readings.hpp"
#include "firmware/procedure/dataset/reading_tables.hpp"
#include "firmware/procedure/dataset/setter_readings.hpp"
#include "firmware/procedure/dataset/sweep.hpp"
#include "firmware/procedure/plan/methods.hpp"
#include "firmware/procedure/plan/wording.hpp"

namespace probebox::procedure {
namespace {

// Which steps were jogs, and what the probe is said to be like.
void addSelftest(metrology::Dataset& dataset, const capture::Recording& recording, const Facts& facts) {
  metrology::Matrix gain;
  for (const auto& row : facts.gain) gain.emplace_back(row.begin(), row.end());
  dataset.config["gain"] = gain;
  auto steps = metrology::Table::withColumns("steps", metrology::kSelftestColumns);
  for (const auto& touch : recording.touches())
    steps.append({static_cast<double>(touch.request.step), touch.request.travel_mm});
  dataset.tables.push_back(std::move(steps));
}

// What of the head and the probe's tools has to be described and is not.
}  // namespace

RunDataset runDataset(Method method, const capture::Recording& recording, const capture::Scales& scales,
                      const Facts& facts) {
  if (needsOf(method) == Needs::screw) return sweepDataset(recording, scales, facts);
  if (needsOf(method) == Needs::tool_setter) return setterDataset(recording, scales, facts);
  if (needsOf(method) == Needs::measuring_unit) return assemblyDataset(recording, scales, facts);
  if (recording.touches().front().request.holds) return holdsDataset(method, recording, scales, facts);
  RunDataset run{capture::touchDataset(recording, scales, std::string{nameOf(method)}), {}, {}};
  auto& config = run.dataset.config;
  if (needsOf(method) == Needs::sphere_diameter) {
    if (facts.sphere_diameter_mm)
      config["effective_diameter_mm"] = *facts.sphere_diameter_mm + facts.stylus_ball_diameter_mm;
    if (method == Method::delay_known_sphere) config["feature"] = std::string{"external"};
  }
  if (needsOf(method) == Needs::plates_gap) {
    if (facts.gap_mm) config["gap_mm"] = *facts.gap_mm;
    config["stylus_ball_diameter_mm"] = facts.stylus_ball_diameter_mm;
    config["feature"] = std::string{"internal"};
  }
  if (readsBalls(method)) run.refusal = addReadings(run.dataset, method, recording, facts);
  if (method == Method::selftest) addSelftest(run.dataset, recording, facts);
  return run;
}

}  // namespace probebox::procedure
