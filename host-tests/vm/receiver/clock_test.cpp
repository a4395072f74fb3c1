#include <cmath>
#include <cstdio>

#include "on_a_bus.hpp"

namespace probebox::vm {
namespace {

using ReceiverClock = ReceiverOnABus;

TEST_F(ReceiverClock, FindsTheFrequencyThatIsPlayed) {
  play({"--ppm", "120"});
  ReceiverGadget::grant();
  ASSERT_TRUE(readUntilLocked()) << source.problem();
  ASSERT_TRUE(readSamples(40'000));
  EXPECT_EQ(clock.state(), ClockState::locked);
  std::printf("frequency: %.2f ppm (played: 120), sigma %.1f us, one arrival %.0f us\n", clock.offsetPpm(),
              clock.sigmaNs() * 1e-3, clock.effectiveJitterNs() * 1e-3);
  EXPECT_NEAR(clock.offsetPpm(), 120, 1);
  expectExactCounts();
}

// Channels a and b are a sine and a cosine of the kernel's clock: a sample tells by itself when it was taken.
TEST_F(ReceiverClock, StampsSamplesWhenTheyWereTakenButForAConstantDelay) {
  play({"--ppm", "-80"});
  ReceiverGadget::grant();
  ASSERT_TRUE(readUntilLocked()) << source.problem();
  ASSERT_TRUE(readSamples(20'000));
  std::vector<double> errors;
  double sigma_ns = 0;
  measure = [&](const CountedDeflection& sample, const clock::CounterStamp& stamp) {
    const double turn_ns = 1e9;
    const double taken_ns = std::atan2(sample.channels_nm[0], sample.channels_nm[1]) / (2 * M_PI) * turn_ns;
    errors.push_back(std::remainder(static_cast<double>(toNs(stamp.at) % 1'000'000'000) - taken_ns, turn_ns));
    sigma_ns = stamp.sigma_ns;
  };
  ASSERT_TRUE(readSamples(40'000));
  double mean = 0;
  for (const double error : errors) mean += error / static_cast<double>(errors.size());
  double variance = 0;
  for (const double error : errors) variance += (error - mean) * (error - mean) / static_cast<double>(errors.size());
  std::printf("stamps: %.0f us late, spread %.1f us, sigma %.1f us, one arrival %.0f us\n", mean * 1e-3,
              std::sqrt(variance) * 1e-3, sigma_ns * 1e-3, clock.effectiveJitterNs() * 1e-3);
  EXPECT_GT(mean, 0) << "nothing arrives before it was taken";
  EXPECT_LT(std::sqrt(variance), 5000);
  // The bus of newer kernels is polled every 125 us. With the counter's beat against that, arrivals are late by a
  // sawtooth: of what a clock remembers that is no noise, and sigma does not tell of it.
  const double of_polling_ns = 125'000 / std::sqrt(12.0);
  EXPECT_LT(std::sqrt(variance), std::hypot(3 * sigma_ns, 0.1 * of_polling_ns));
}

TEST_F(ReceiverClock, LocksAnewAfterAnUnplugAndAfterTheCounterBeganAnew) {
  play({"--ppm", "60"});
  ReceiverGadget::grant();
  ASSERT_TRUE(readUntilLocked()) << source.problem();
  gadget.unbind();
  ASSERT_TRUE(readUntil([&] { return losses == 1; }));
  EXPECT_EQ(clock.state(), ClockState::unlocked);
  gadget.bind();
  ReceiverGadget::grant();
  ASSERT_TRUE(readUntilLocked()) << source.problem();
  EXPECT_EQ(clock.epoch(), 2U);
  EXPECT_EQ(clock.counters().restarts, 0U) << "the source said that it went";

  const auto missing = clock.counters().missing;
  player->tell("restart 100000");
  ASSERT_TRUE(readUntil([&] { return clock.counters().restarts == 1; }));
  EXPECT_EQ(clock.counters().missing, missing) << "no loss is claimed";
  ASSERT_TRUE(readUntilLocked());
  EXPECT_EQ(clock.epoch(), 3U);
  EXPECT_EQ(losses, 1U);
  expectExactCounts();
}

}  // namespace
}  // namespace probebox::vm
