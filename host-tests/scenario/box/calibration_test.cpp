#include <cmath>
#include <gtest/gtest.h>

#include "host-tests/emulation/scenario.hpp"
#include "host-tests/support/no_alloc.hpp"

namespace probebox::scenario {
namespace {

using namespace std::chrono_literals;

TEST(Calibration, FindsTheHiddenDelayWithinItsOwnUncertainty) {
  double pulls_squared = 0;
  constexpr int kRuns = 6;
  for (std::uint64_t seed = 1; seed <= kRuns; ++seed) {
    world::Config config = usualWorld();
    const double tau_machine_s = 0.002 + 0.001 * static_cast<double>(seed);
    config.delays.tau_machine_s = {tau_machine_s, tau_machine_s, tau_machine_s};
    Scenario scenario{config, seed};
    scenario.recorder().keeps_bytes = false;
    scenario.run(3s);
    const auto solved = scenario.calibrate();
    ASSERT_TRUE(solved) << "seed " << seed << " stopped in step " << scenario.state().procedure.step;
    ASSERT_TRUE(solved->ok()) << solved->error().reason;
    const auto* tau = solved->value().find("tau_s");
    const double sd = tau->standardDeviation().value();
    EXPECT_LT(sd, 2e-5);
    pulls_squared += std::pow((tau->value() - scenario.truth().tau_s[0]) / sd, 2);
    EXPECT_EQ(scenario.state().procedure.state, procedure::State::proposed);
  }
  // Chi-square with six degrees of freedom: both limits are passed once in about 1000 times.
  EXPECT_GT(pulls_squared, 0.38);
  EXPECT_LT(pulls_squared, 22.5);
}

TEST(Calibration, AsksAgainForATouchThatLostASource) {
  Scenario scenario;
  scenario.recorder().keeps_bytes = false;
  scenario.run(3s);
  scenario.inject(world::FaultKind::sync_silent, 8s, 3s);
  const auto solved = scenario.calibrate();
  ASSERT_TRUE(solved && solved->ok());
  EXPECT_LT(std::abs(solved->value().find("tau_s")->value() - scenario.truth().tau_s[0]), 2e-5);
}

TEST(Calibration, TakesNoMemoryOnTheTickPath) {
  Scenario scenario;
  scenario.recorder().keeps_bytes = false;
  scenario.run(1s);
  std::uint64_t allocations = 0;
  std::uint64_t pushed = 0;
  class Watch : public box::Outputs {
   public:
    bool block(SampleIndex, std::uint32_t, std::span<const std::byte>) override { return true; }
    bool lost(const latch::Lost&) override { return true; }
    void trigger(const box::PlacedTrigger&) override {}
    void state(const box::State&) override {}
    void solve(std::uint32_t) override { solved = true; }
    bool solved{};
  } outputs;
  box::Box twin{usualBox(usualWorld()), outputs};
  scenario.around = [&](const Event& event) {
    const support::NoAlloc guard;
    twin.push(event);
    allocations += guard.allocations();
    ++pushed;
  };
  ASSERT_TRUE(scenario.calibrate());
  EXPECT_TRUE(outputs.solved);
  EXPECT_GT(pushed, 100'000U);
  EXPECT_EQ(allocations, 0U);
}

}  // namespace
}  // namespace probebox::scenario
