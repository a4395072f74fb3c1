// The check of a machine, made by the controller of the emulated one: what it says against what was put into the world.
#include <cmath>
#include <gtest/gtest.h>
#include <string>

#include "host-tests/emulation/scenario.hpp"
#include "host-tests/support/runs.hpp"

namespace probebox::scenario {
namespace {

using namespace std::chrono_literals;

// Mean drift over a run, mm/min.
double meanDrift(const board::WorldDrift& drift, std::size_t axis, double from_s, double until_s) {
  const double constant_s = drift.time_constant_s;
  if (constant_s <= 0) return drift.rate_mm_min[axis];
  const double left = constant_s * (std::exp(-from_s / constant_s) - std::exp(-until_s / constant_s));
  return left / (until_s - from_s) * drift.rate_mm_min[axis];
}

void expectNear(const metrology::Result& result, const std::string& key, const std::vector<double>& truth) {
  const auto* found = result.find(key);
  ASSERT_NE(found, nullptr) << key;
  ASSERT_GE(found->values.size(), truth.size()) << key;
  const auto& u = found->uncertainty.empty() ? found->sd : found->uncertainty;
  for (std::size_t k = 0; k < truth.size(); ++k) EXPECT_NEAR(found->values[k], truth[k], 4 * u[k]) << key << " " << k;
}

// Within 4 u of what is in the world.
void expectFound(world::Config config, std::uint64_t seed) {
  SCOPED_TRACE("seed " + std::to_string(seed));
  config.screws = {};
  Scenario scenario{config, seed};
  scenario.recorder().keeps_bytes = false;
  scenario.run(2s);
  const auto begun = scenario.now();
  const auto solved = scenario.calibrate(procedure::kMachineCheck);
  const double from_s = toSeconds(begun - config.start), until_s = toSeconds(scenario.now() - config.start);
  ASSERT_TRUE(solved && solved->ok()) << (solved ? solved->error().reason : "no result");
  EXPECT_LT(until_s - from_s, 420) << "seven minutes";
  EXPECT_EQ(scenario.machine().crashes(), 0U);
  EXPECT_EQ(scenario.machine().stylus().contactCount(), scenario.state().procedure.steps);
  const metrology::Result& result = solved->value();
  EXPECT_EQ(scenario.dataset().method, "machine-check");

  const auto& probe = config.probe;
  std::vector<double> lost, drift, drift_of_zero;
  for (std::size_t k = 0; k < 3; ++k) {
    lost.push_back(config.axes.lost_motion_mm[k] + probe.hysteresis_mm);
    drift.push_back(-1e3 * meanDrift(config.axes.drift, k, from_s,
                                     until_s));  // the machine carries the probe away from what it touches
    drift_of_zero.push_back(1e3 * meanDrift(probe.drift, k, from_s, until_s));
  }
  expectNear(result, "lost_motion_mm", lost);
  expectNear(result, "probe_hysteresis_mm", {probe.hysteresis_mm});
  expectNear(result, "machine_drift_um_per_min", drift);
  expectNear(result, "zero_drift_um_per_min", drift_of_zero);
  // Surfaces that are found too deep are inwards.
  expectNear(result, "lobing_mm", {-probe.lobe_twice_mm, 0, -probe.lobe_mm, 0, 0, 0});
  const double curvature = probe.curvature / probe.range_mm;
  expectNear(result, "gain_curvature_per_mm", {curvature, curvature, curvature});
  expectNear(result, "static_error_mm", {0});
  const auto tau_s = scenario.truth().tau_s;
  expectNear(result, "tau_axis_s", {tau_s.begin(), tau_s.end()});
  EXPECT_EQ(result.find("line_machine_hz") != nullptr, !config.vibrations.empty());
  if (config.vibrations.empty()) return;
  expectNear(result, "line_machine_hz", {config.vibrations.front().frequency_hz});
  expectNear(result, "line_machine_mm", {config.vibrations.front().amplitude_mm});
}

TEST(MachineCheck, FindsWhatAWornMachineErrsBy) {
  auto config = warmingWorld(WORN);
  config.encoders.power_up_mm = {};
  config.linear_axes = {};  // on one sphere scale and squareness look like two lobes
  for (std::uint64_t seed = 1; seed <= runs(12) / 4; ++seed) expectFound(config, seed);
}

TEST(MachineCheck, FindsNothingOnASoundMachine) {
  for (std::uint64_t seed = 1; seed <= runs(12) / 4; ++seed) expectFound(usualWorld(), seed);
}

}  // namespace
}  // namespace probebox::scenario
