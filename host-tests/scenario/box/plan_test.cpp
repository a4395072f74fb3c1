#include <cmath>
#include <gtest/gtest.h>

#include "firmware/procedure/methods/methods.hpp"
#include "host-tests/emulation/scenario.hpp"
#include "tools/plan/forecast.hpp"

// A forecast knows rates, noise and acceleration, and nothing of bounces, links, clocks and features that stand a
// little beside. What a run on the emulated machine then states is near it all the same.
namespace probebox::scenario {
namespace {

using namespace std::chrono_literals;
using procedure::LiveMethod;

plan::SetUp setUpOf(const world::Config& config) {
  return {.machine_rate_hz = config.encoders.rate_hz,
          .machine_noise_um = config.encoders.noise_um,
          .probe_rate_hz = config.probe.rate_hz,
          .probe_noise_um = config.probe.noise_um,
          .acceleration_mm_s2 = config.axes.acceleration_mm_s2};
}

class Planned : public testing::TestWithParam<const LiveMethod*> {};

TEST_P(Planned, RunStatesWhatWasForecast) {
  const auto config = usualWorld();
  const auto expected = plan::forecast({.method = GetParam()}, setUpOf(config));
  ASSERT_TRUE(expected) << expected.error().reason;
  const auto& forecast = expected->estimates.front();
  double squares = 0;
  constexpr int kPlanSeeds = 3;
  for (std::uint64_t seed = 1; seed <= kPlanSeeds; ++seed) {
    Scenario scenario{config, seed};
    scenario.recorder().keeps_bytes = false;
    scenario.run(2s);
    const auto solved = scenario.calibrate(*GetParam());
    ASSERT_TRUE(solved && solved->ok());
    squares += std::pow(solved->value().find(forecast.key)->sd.front(), 2) / kPlanSeeds;
  }
  EXPECT_GT(std::sqrt(squares), 0.7 * forecast.sd.front());
  EXPECT_LT(std::sqrt(squares), 1.4 * forecast.sd.front());
}

INSTANTIATE_TEST_SUITE_P(Methods, Planned,
                         testing::Values(&procedure::kDelayMultiSpeed, &procedure::kDelayKnownSphere,
                                         &procedure::kDelayPlates, &procedure::kDelayPerAxis,
                                         &procedure::kDelayCylinder, &procedure::kDelayCube),
                         [](const auto& of_one) {
                           std::string name{of_one.param->name()};
                           std::erase(name, '-');
                           return name;
                         });

}  // namespace
}  // namespace probebox::scenario
