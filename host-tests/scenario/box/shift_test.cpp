#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <string>

#include "firmware/procedure/methods/methods.hpp"
#include "host-tests/emulation/scenario.hpp"
#include "host-tests/support/runs.hpp"
#include "pulls.hpp"

// `joint`, run on the emulated machine while its screws warm up.
namespace probebox::scenario {
namespace {

using namespace std::chrono_literals;

// Nearly warm at the end of a run.
world::Config quicklyWarming() {
  auto config = warmingWorld();
  config.encoders.power_up_mm = {};
  double time_constant_s = 80;
  for (auto& screw : config.screws) screw->time_constant_s = time_constant_s += 25;
  return config;
}

// K of every screw in use, by the box and in the case; the emulated nut goes as far as its screw grows.
void useGain(Scenario& scenario, double gain) {
  scenario.describeBy([gain](box::BoxConfig& box) {
    for (auto& screw : box.corrections.screws) screw.model.gain = -gain;
  });
  for (auto& screw : scenario.facts.screws) screw->gain = gain;
  scenario.restartBox();
}

metrology::Solved solvedShift(Scenario& scenario, double gain, const ProcedureOptions& options = {}) {
  scenario.recorder().keeps_bytes = false;
  useGain(scenario, gain);
  scenario.run(2s);
  const auto solved = scenario.calibrate(procedure::kJoint, options);
  return solved ? *solved : metrology::Solved{metrology::Refusal{"no-result", "the run did not end"}};
}

TEST(LiveShift, TellsDelayAxisGainsAndDriftWhateverGainIsInUse) {
  Pulls pulls;
  for (std::uint64_t seed = 1; seed <= runs(20); ++seed) {
    const double in_use = seed % 2 == 0 ? 1 : 0.8;
    auto config = quicklyWarming();
    config.part_spindle.point_mm[0] += 0.01 * static_cast<double>(seed);
    Scenario scenario{config, seed};
    const auto solved = solvedShift(scenario, in_use);
    ASSERT_TRUE(solved.ok()) << solved.error().reason;
    EXPECT_EQ(scenario.machine().crashes(), 0U);
    const auto& result = solved.value();
    const auto add = [&](std::string_view key, std::size_t k, double truth) {
      const auto* found = result.find(key);
      ASSERT_NE(found, nullptr) << key;
      pulls.add(found->values[k], truth, found->sd[k]);
    };
    const auto truth = scenario.truth();
    add("tau_s", 0, truth.tau_s[0]);
    for (const auto* gain : {"K_x", "K_y", "K_z"}) {
      add(gain, 0, 1);
    }
    EXPECT_LT(result.find("K_x")->sd[0], 0.05);
    EXPECT_LT(result.find("K_y")->sd[0], 0.05);
    for (std::size_t axis = 0; axis < 3; ++axis) add("drift_rate_um_per_min", axis, 0);
    const double up = result.find("mean_z_mm")->value() - truth.part_axis_point_mm[2];
    for (std::size_t k = 0; k < 2; ++k) {
      add("C_tilt_rad", k, truth.part_axis[k] / truth.part_axis[2]);
      add("centre_mm", k,
          truth.part_axis_point_mm[k] + truth.part_axis[k] / truth.part_axis[2] * up -
              config.probe_spindle.stylus_offset_mm[k]);
    }
    const auto warned = testing::Contains(testing::StartsWith("screw-gain"));
    if (in_use == 1)
      EXPECT_THAT(result.warnings, testing::Not(warned));
    else
      EXPECT_THAT(result.warnings, warned);
  }
  pulls.expectHonest();
}

// Growth in proportion to time is a drift.
TEST(LiveShift, OfScrewsThatWarmEvenlyInTimeIsRefused) {
  auto config = quicklyWarming();
  for (auto& screw : config.screws) screw->warm_um *= 50, screw->time_constant_s = 20'000;
  Scenario scenario{config, 5};
  const auto solved = solvedShift(scenario, 1);
  ASSERT_FALSE(solved.ok());
  EXPECT_EQ(solved.error().name, "not-separable");
}

TEST(LiveShift, OfColdScrewsHasNoGains) {
  auto config = quicklyWarming();
  for (auto& screw : config.screws) screw->warm_um = 0;
  Scenario scenario{config, 6};
  const auto solved = solvedShift(scenario, 1, {.angles = 8});
  ASSERT_TRUE(solved.ok()) << solved.error().reason;
  EXPECT_EQ(solved->find("K_x"), nullptr);
  EXPECT_NEAR(solved->find("tau_s")->value(), scenario.truth().tau_s[0], 4 * solved->find("tau_s")->sd[0]);
}

// The delay comes from two speeds.
TEST(LiveShift, AtOneSpeedIsRefused) {
  Scenario scenario{quicklyWarming(), 7};
  ProcedureOptions options;
  options.speed_count = 1;
  options.speeds_mm_s[0] = 15;
  EXPECT_EQ(solvedShift(scenario, 1, options).error().name, "not-separable");
}

}  // namespace
}  // namespace probebox::scenario
