#include "firmware/corrections/corrections.hpp"

#include <gtest/gtest.h>

namespace probebox::corrections {
namespace {

constexpr TickMap kLocked{
    .tick = {}, .at = {}, .period_q32_ns = 0, .sigma_ns = 400, .state = ClockState::locked, .holdover_ms = 0};

TEST(Corrections, StartInvalid) {
  Corrections corrections{{}};
  corrections.advance(monoTime(0), TickMap{}, {});
  EXPECT_FALSE(corrections.state().valid);
  EXPECT_FALSE(corrections.state().delay.calibrated);
  EXPECT_FALSE(corrections.state().clock_locked);
}

TEST(Corrections, CarryTheDelayInForceAndTheLedger) {
  Corrections corrections{{}};
  corrections.push(DelayActivated{.result_id = 5, .tau_s = {1e-3, 2e-3, 3e-3}, .sd_s = {1e-6, 1e-6, 2e-6}, .at = {}});
  corrections.advance(monoTime(0), kLocked, {.produced = 100, .lost_at_source = 0, .lost_in_queue = 0});
  EXPECT_TRUE(corrections.state().delay.calibrated);
  EXPECT_EQ(corrections.state().delay.tau_s[2], 3e-3);
  EXPECT_EQ(corrections.state().clock_sigma_ns, 400U);
  EXPECT_FALSE(corrections.state().loss_seen);
  corrections.advance(monoTime(1), kLocked, {.produced = 200, .lost_at_source = 0, .lost_in_queue = 1});
  EXPECT_TRUE(corrections.state().loss_seen);
  corrections.push(DelayActivated{});
  EXPECT_FALSE(corrections.state().delay.calibrated) << "rolled back to none";
}

TEST(Corrections, AreRefusedASourceThatTheMachineDoesNotHave) {
  CorrectionsConfig config;
  config.mask = bitOf(SourceKind::screw);
  const auto refused = whyRefused(config);
  ASSERT_TRUE(refused);
  EXPECT_NE(refused->what.find("[screw.X]"), std::string::npos);
}

}  // namespace
}  // namespace probebox::corrections
