#include <algorithm>
#include <cmath>
#include <gtest/gtest.h>
#include <numbers>

#include "streams.hpp"

namespace probebox::world {
namespace {

using testing::quiet;
using testing::run;
using testing::seconds;

constexpr double kExpectedSamples = 20'000;

template <class Samples>
std::uint64_t sequenceGaps(const Samples& samples) {
  std::uint64_t missing = samples.empty() ? 0 : samples.front().sequence;
  for (std::size_t i = 1; i < samples.size(); ++i) missing += samples[i].sequence - samples[i - 1].sequence - 1;
  return missing;
}

TEST(Encoders, LatchAtTheirRateWithTheirOwnPhase) {
  World world{quiet(), 1};
  const auto streams = run(world, 10);
  for (const auto& counts : streams.counts) {
    ASSERT_EQ(counts.size(), 5000U);
    EXPECT_GE(counts.front().at, seconds(0));
    EXPECT_LT(counts.front().at, seconds(0.002));
    for (std::size_t i = 1; i < counts.size(); ++i) {
      ASSERT_EQ(counts[i].at - counts[i - 1].at, Nanoseconds{2'000'000});
      ASSERT_EQ(counts[i].sequence, counts[i - 1].sequence + 1);
    }
  }
  EXPECT_NE(streams.counts[0].front().at, streams.deflections.front().at);
}

TEST(Encoders, ReadPositionWithNoiseAndSense) {
  Config config = quiet();
  config.encoders.noise_um = 0.5;
  config.machine.axes[1].sense = -1;
  config.encoders.counts_per_mm = 50'000;
  config.axes.home_mm = {12.5, 7.25, -80};
  World world{config, 2};
  const auto streams = run(world, 20);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    std::vector<double> mm;
    for (const Count& count : streams.counts[axis]) mm.push_back(static_cast<double>(count.counts) / 50'000);
    const auto [mean, sd] = testing::momentsOf(mm);
    EXPECT_NEAR(mean, config.machine.axes[axis].sense * config.axes.home_mm[axis], 4 * 0.5e-3 / 100);
    // Quantisation to counts adds a twelfth of a count squared.
    EXPECT_NEAR(1e3 * sd, std::hypot(0.5, 20 / std::sqrt(12) * 1e-3), 4 * 0.5 / std::sqrt(20'000));
  }
}

TEST(Encoders, AreStaleByTheDelayOfTheirAxis) {
  Config config = quiet();
  config.delays.tau_machine_s = {0.003, 0.0042, 0.0061};
  World world{config, 3};
  world.machine().moveTo(config.axes.home_mm + Vector3{30, 20, 10}, 40, seconds(0.1));
  const auto streams = run(world, 1);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    for (const Count& count : streams.counts[axis]) {
      const Vector3 then =
          world.machine().positionAt(count.at - Nanoseconds{std::llround(1e9 * config.delays.tau_machine_s[axis])});
      ASSERT_NEAR(static_cast<double>(count.counts) * 1e-6, then[axis], 0.6e-6);
    }
  }
}

TEST(Encoders, FollowTheTurnOfThePartAndFallSilentAlone) {
  Config config = quiet();
  config.rotary.c_counts_per_deg = 1000;
  config.c_power_up_deg = 10;
  config.rotary.speed_rad_s = 1;
  World world{config, 3};
  EXPECT_TRUE(world.inject({.kind = FaultKind::angles_silent, .at = seconds(2), .duration = std::chrono::seconds{1}}));
  ASSERT_TRUE(world.machine().turnTo({.c_rad = 1.0}, seconds(0.1)));
  const auto streams = run(world, 4);
  const double tau_s = config.delays.tau_machine_s[2];
  for (const auto& count : streams.angles) {
    const double turned_s = std::clamp(toSeconds(count.at - seconds(0)) - tau_s - 0.1, 0.0, 1.0);
    ASSERT_NEAR(static_cast<double>(count.counts), 1000 * (10 + turned_s * 180 / std::numbers::pi), 0.6);
  }
  EXPECT_EQ(streams.angles.size(), 3 * 500U);
  EXPECT_EQ(sequenceGaps(streams.angles), 500U);
  EXPECT_EQ(streams.counts[0].size(), 4 * 500U);
}

TEST(Probe, SamplesAtItsRateWithItsNoise) {
  Config config = quiet();
  config.probe.noise_um = 0.4;
  World world{config, 4};
  const auto samples = run(world, 20).deflections;
  ASSERT_EQ(static_cast<double>(samples.size()), kExpectedSamples);
  EXPECT_EQ(samples[1].at - samples[0].at, Nanoseconds{1'000'000});
  for (std::size_t channel = 0; channel < 3; ++channel) {
    std::vector<double> um;
    for (const Deflection& sample : samples) um.push_back(1e-3 * sample.channels_nm[channel]);
    const auto [mean, sd] = testing::momentsOf(um);
    EXPECT_NEAR(mean, 0, 4 * 0.4 / std::sqrt(kExpectedSamples));
    EXPECT_NEAR(sd, 0.4, 4 * 0.4 / std::sqrt(2 * kExpectedSamples));
  }
}

TEST(Sensors, DropSamplesExactlyAsCounted) {
  Config config = quiet();
  config.probe.dropout_probability = 0.01;
  config.encoders.dropout_probability = 0.02;
  World world{config, 6};
  world.inject({.kind = FaultKind::probe_silent, .at = seconds(3), .duration = std::chrono::milliseconds{500}});
  world.inject({.kind = FaultKind::encoders_silent, .at = seconds(4), .duration = std::chrono::milliseconds{200}});
  const auto streams = run(world, 10);
  const Ledger ledger = world.truth().ledger;
  EXPECT_EQ(ledger.probe_samples, 10'000U);
  EXPECT_EQ(ledger.encoder_latches, 15'000U);
  EXPECT_NEAR(static_cast<double>(ledger.dropped_probe), 500 + 95, 45);
  EXPECT_NEAR(static_cast<double>(ledger.dropped_encoders), 300 + 294, 75);
  EXPECT_EQ(streams.deflections.size(), ledger.probe_samples - ledger.dropped_probe);
  EXPECT_EQ(sequenceGaps(streams.deflections), ledger.dropped_probe);
  std::uint64_t handed_out = 0, missing = 0;
  for (const auto& counts : streams.counts) {
    handed_out += counts.size();
    missing += sequenceGaps(counts);
  }
  EXPECT_EQ(handed_out, ledger.encoder_latches - ledger.dropped_encoders);
  EXPECT_EQ(missing, ledger.dropped_encoders);
  for (const Deflection& sample : streams.deflections) ASSERT_TRUE(sample.at < seconds(3) || sample.at >= seconds(3.5));
}

}  // namespace
}  // namespace probebox::world
