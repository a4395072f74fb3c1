#include "firmware/corrections/corrections.hpp"

#include <chrono>
#include <gtest/gtest.h>

namespace probebox::corrections {
namespace {

using std::chrono::milliseconds;

constexpr TickMap kLocked{
    .tick = {}, .at = {}, .period_q32_ns = 0, .sigma_ns = 400, .state = ClockState::locked, .holdover_ms = 0};

TEST(Corrections, StartInvalid) {
  Corrections corrections;
  corrections.advance(monoTime(0), TickMap{}, {});
  EXPECT_FALSE(corrections.snapshot().valid);
  EXPECT_FALSE(corrections.snapshot().delay.calibrated);
  EXPECT_FALSE(corrections.snapshot().clock_locked);
}

TEST(Corrections, BeatOnlyWhileTheWholeChainDelivers) {
  Corrections corrections;
  MonoTime now = monoTime(0);
  const auto run = [&](int steps, bool records) {
    for (int i = 0; i < steps; ++i) {
      if (records) corrections.recordArrived();
      corrections.advance(now, kLocked, {});
      now += milliseconds{10};
    }
    return corrections.snapshot().heartbeat;
  };
  const auto after_second = run(101, true);
  EXPECT_EQ(after_second, 10);
  const auto after_silence = run(100, false);
  EXPECT_LE(after_silence - after_second, 1);
  EXPECT_EQ(run(100, true) - after_silence, 10);
}

TEST(Corrections, CarryTheDelayInForceAndTheLedger) {
  Corrections corrections;
  corrections.push(DelayActivated{.result_id = 5, .tau_s = {1e-3, 2e-3, 3e-3}, .sd_s = {1e-6, 1e-6, 2e-6}, .at = {}});
  corrections.advance(monoTime(0), kLocked, {.produced = 100, .lost_at_source = 0, .lost_in_queue = 0});
  EXPECT_TRUE(corrections.snapshot().delay.calibrated);
  EXPECT_EQ(corrections.snapshot().delay.tau_s[2], 3e-3);
  EXPECT_EQ(corrections.snapshot().clock_sigma_ns, 400U);
  EXPECT_FALSE(corrections.snapshot().loss_seen);
  corrections.advance(monoTime(1), kLocked, {.produced = 200, .lost_at_source = 0, .lost_in_queue = 1});
  EXPECT_TRUE(corrections.snapshot().loss_seen);
}

}  // namespace
}  // namespace probebox::corrections
