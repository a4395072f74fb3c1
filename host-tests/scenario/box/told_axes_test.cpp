#include <gtest/gtest.h>

#include "host-tests/emulation/scenario.hpp"

// The whole box with positions that the controller tells, on its own counter.
namespace probebox::scenario {
namespace {

using namespace std::chrono_literals;

TEST(ToldAxes, AreMappedByTheControllersOwnCounter) {
  Scenario scenario{usualWorld(), 1, ProbeIs::stamped_axes_told};
  ASSERT_TRUE(scenario.runUntil([&] { return scenario.state().control_clock.state == ClockState::locked; }, 30s));
  scenario.run(10s);
  const auto& clock = scenario.state().control_clock;
  EXPECT_NEAR(clock.offset_ppm, 0, 20);
  EXPECT_LT(clock.sigma_ns, 50'000);
  EXPECT_EQ(clock.counters.relocks, 0U);
  EXPECT_EQ(scenario.state().snapshot.events.disordered, 0U);
  EXPECT_TRUE(scenario.recorded().contiguous);
  const auto received = scenario.recorded().received;
  scenario.run(1s);
  EXPECT_NEAR(static_cast<double>(scenario.recorded().received - received), 2000, 150);
}

// Their constant lateness is part of the delay that the calibration finds.
TEST(ToldAxes, HaveALatenessThatTheCalibrationAbsorbs) {
  Scenario scenario{usualWorld(), 2, ProbeIs::stamped_axes_told};
  scenario.recorder().keeps_bytes = false;
  scenario.run(70s);  // until the jitter has been learned
  const auto solved = scenario.calibrate();
  ASSERT_TRUE(solved) << "stopped in step " << scenario.state().procedure.step;
  ASSERT_TRUE(solved->ok()) << solved->error().reason;
  const auto* tau = solved->value().find("tau_s");
  const double sd = tau->standardDeviation().value();
  EXPECT_LT(sd, 1e-4);
  // The clock follows the mode of the arrivals, which a skewed delay does not fix to better than its spread.
  const double spread_s = ToldAxes::kShape * ToldAxes::kMedianNs * 1e-9;
  EXPECT_NEAR(tau->value(), scenario.truth().tau_s[0] + ToldAxes::kMedianNs * 1e-9, 5 * sd + 0.5 * spread_s);
}

TEST(ToldAxes, ThatStopAndBeginAnewLoseSamplesByName) {
  Scenario scenario{usualWorld(), 3, ProbeIs::stamped_axes_told};
  ASSERT_TRUE(scenario.runUntil([&] { return scenario.state().control_clock.state == ClockState::locked; }, 30s));
  scenario.run(2s);
  scenario.controllerThatTells().setSilent(true);
  scenario.run(20s);
  scenario.controllerThatTells().restart();
  scenario.controllerThatTells().setSilent(false);
  ASSERT_TRUE(scenario.runUntil(
      [&] {
        return scenario.state().control_clock.state == ClockState::locked &&
               scenario.state().control_clock.counters.relocks == 1;
      },
      30s));
  scenario.run(1s);
  EXPECT_TRUE(scenario.recorded().contiguous);
  EXPECT_GT(scenario.recorded().lost_samples, 35'000U);
  const auto received = scenario.recorded().received;
  scenario.run(1s);
  EXPECT_NEAR(static_cast<double>(scenario.recorded().received - received), 2000, 150);
}

// Where its positions begin, it alone knows.
TEST(ToldAxes, OfAControllerThatBeginsAnewAreReferencedNoMore) {
  for (const bool are_absolute : {false, true}) {
    auto config = usualWorld();
    if (!are_absolute) config.encoders.power_up_mm = {1, 1, 1};
    Scenario scenario{config, 4, ProbeIs::stamped_axes_told};
    ASSERT_TRUE(scenario.runUntil([&] { return scenario.state().snapshot.referenced; }, 60s));
    scenario.run(1s);
    const auto losses = scenario.state().snapshot.axes[0].reference_losses;
    scenario.controllerThatTells().setSilent(true);
    scenario.run(100ms);
    scenario.controllerThatTells().restart();
    scenario.controllerThatTells().setSilent(false);
    scenario.run(20ms);
    for (const auto& axis : scenario.state().snapshot.axes) {
      EXPECT_EQ(axis.referenced, are_absolute);
      EXPECT_EQ(axis.reference_losses, losses + (are_absolute ? 0 : 1));
    }
  }
}

}  // namespace
}  // namespace probebox::scenario
