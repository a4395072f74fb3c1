#include "drivers/world/from_description.hpp"

#include <gtest/gtest.h>

#include "drivers/world/world.hpp"

namespace probebox::world {
namespace {

board::World described() {
  board::World world;
  world.delays = {{0.005, 0.006, 0.007}, 0.0002};
  world.clock = {.period_ns = 500'000,
                 .drift_ppm = 30,
                 .wander_ppm = 0.01,
                 .bias_us = 9,
                 .jitter = board::Jitter::gauss,
                 .jitter_us = 4,
                 .outlier_probability = 0.02,
                 .outlier_us = 70,
                 .missing_probability = 0.001,
                 .doubled_probability = 0.002,
                 .spurious_probability = 0.003};
  world.encoders = {.rate_hz = 800, .noise_um = 0.3, .counts_per_mm = 2e5, .dropout_probability = 0.004};
  world.axes = {.acceleration_mm_s2 = 9000, .traverse_mm_s = 120, .home_mm = {1, 2, 100}};
  world.probe = {.rate_hz = 1500,
                 .noise_um = 0.7,
                 .gain = {{{1.1, 0, 0}, {0, 0.9, 0}, {0.1, 0, 1}}},
                 .range_mm = 0.8,
                 .bounce_mm = 0.01,
                 .bounce_decay_s = 0.003,
                 .dropout_probability = 0.005,
                 .friction = 0.12};
  world.sphere = {{1, 2, 3}, 10, 2};
  world.cycle = {.speeds_mm_s = {5}, .overtravel_mm = 0.5, .clearance_mm = 1, .dwell_s = 0.25, .repeats = 1};
  return world;
}

TEST(FromDescription, TakesEveryValue) {
  const Config config = fromDescription(described());
  EXPECT_EQ(config.delays.tau_machine_s, (Vector3{0.005, 0.006, 0.007}));
  EXPECT_EQ(config.delays.tau_probe_s, 0.0002);
  EXPECT_EQ(config.sync.nominal_period, Nanoseconds{500'000});
  EXPECT_EQ(config.sync.drift_ppm, 30);
  EXPECT_EQ(config.sync.wander_ppm, 0.01);
  EXPECT_EQ(config.sync.bias_us, 9);
  EXPECT_EQ(config.sync.jitter, Jitter::gauss);
  EXPECT_EQ(config.sync.jitter_us, 4);
  EXPECT_EQ(config.sync.outlier_probability, 0.02);
  EXPECT_EQ(config.sync.outlier_us, 70);
  EXPECT_EQ(config.sync.missing_probability, 0.001);
  EXPECT_EQ(config.sync.doubled_probability, 0.002);
  EXPECT_EQ(config.sync.spurious_probability, 0.003);
  EXPECT_EQ(config.encoders.rate_hz, 800);
  EXPECT_EQ(config.encoders.noise_um, 0.3);
  EXPECT_EQ(config.encoders.counts_per_mm, 2e5);
  EXPECT_EQ(config.encoders.dropout_probability, 0.004);
  EXPECT_EQ(config.axes.acceleration_mm_s2, 9000);
  EXPECT_EQ(config.axes.traverse_mm_s, 120);
  EXPECT_EQ(config.axes.home_mm, (Vector3{1, 2, 100}));
  EXPECT_EQ(config.probe.rate_hz, 1500);
  EXPECT_EQ(config.probe.noise_um, 0.7);
  EXPECT_EQ(config.probe.gain[2], (Vector3{0.1, 0, 1}));
  EXPECT_EQ(config.probe.range_mm, 0.8);
  EXPECT_EQ(config.probe.bounce_mm, 0.01);
  EXPECT_EQ(config.probe.bounce_decay_s, 0.003);
  EXPECT_EQ(config.probe.dropout_probability, 0.005);
  EXPECT_EQ(config.probe.friction, 0.12);
  EXPECT_TRUE(config.probe.trigger_line);
  EXPECT_EQ((World{config, 1}.truth().effective_radius_mm), 12);
}

TEST(FromDescription, TakesTheSensesOfTheMachine) {
  board::Machine machine;
  machine.axes[1].sense = -1;
  EXPECT_EQ(fromDescription(described(), machine).encoders.sense, (std::array{1, -1, 1}));
}

TEST(FromDescription, GivesTheControllerAnErrorOfItsOwn) {
  const ControllerConfig config = controllerFromDescription(described(), {0.1, 0, -0.1});
  EXPECT_EQ(config.nominal_centre_mm, (Vector3{1.1, 2, 2.9}));
  EXPECT_EQ(config.nominal_effective_radius_mm, 12);
  EXPECT_EQ(config.park_mm, (Vector3{1, 2, 100}));
  EXPECT_EQ(config.dwell, std::chrono::milliseconds{250});
}

TEST(FromDescription, SchedulesFaultsFromTheStartOn) {
  auto world = described();
  world.faults = {{.kind = board::FaultKind::sync_silent, .at_s = 4, .lasts_s = 2, .jump_s = 0},
                  {.kind = board::FaultKind::clock_jumps, .at_s = 5, .lasts_s = 0, .jump_s = -300e-6}};
  const MonoTime start{std::chrono::seconds{100}};
  const auto faults = faultsFromDescription(world, start);
  ASSERT_EQ(faults.size(), 2U);
  EXPECT_EQ(faults[0].kind, FaultKind::stop_sync);
  EXPECT_EQ(faults[0].at, start + std::chrono::seconds{4});
  EXPECT_EQ(faults[0].duration, std::chrono::seconds{2});
  EXPECT_EQ(faults[1].kind, FaultKind::jump_clock);
  EXPECT_EQ(faults[1].jump, std::chrono::microseconds{-300});
}

}  // namespace
}  // namespace probebox::world
