#include <gtest/gtest.h>
#include <optional>

#include "machine_on_a_desk.hpp"

// Triggers and the turning axis while no samples come: the probe is silent, or the encoders are.
namespace probebox::corrections {
namespace {

using std::chrono::microseconds;

class WithoutSamples : public testing::Test {
 protected:
  WithoutSamples() {
    machine_.run(0.3);
    machine_.home();
    machine_.run(0.3);
  }
  // Moves Z down at this speed.
  void move(double speed_mm_s, double seconds) {
    for (int i = 0; i < std::lround(seconds * 1000); ++i) {
      machine_.position_mm[2] -= speed_mm_s * 1e-3;
      machine_.tick();
    }
  }
  void touch(microseconds ago = {}) {
    machine_.corrections.push(Edge{LineRole::trigger, 0, Level::active, ++touches_, machine_.now - ago});
  }
  const published::TriggerStamp& last() const { return machine_.snapshot().last_trigger; }
  std::uint32_t unplaced() const { return machine_.snapshot().unplaced_triggers; }

  MachineOnADesk machine_{MachineOnADesk::usual()};
  std::uint32_t touches_{};
};

// A tool touches the setter while the probe lies in its magazine.
TEST_F(WithoutSamples, ATriggerIsPlacedByTheCounts) {
  touch();
  machine_.run(0.2);
  ASSERT_EQ(last().number, 1U);
  machine_.probe = false;
  machine_.run(1);
  move(5, 0.503);
  const double at_mm = machine_.position_mm[2] + 5 * 0.3e-3;
  touch(microseconds{300});
  move(5, 0.02);
  machine_.run(0.05);
  EXPECT_EQ(last().number, 2U);
  EXPECT_TRUE(last().has_position[0]);
  EXPECT_TRUE(last().has_position[2]);
  EXPECT_NEAR(last().position_mm[2], at_mm, 2e-6);
  EXPECT_EQ(unplaced(), 0U);
}

// As samples are, which the latch moves by the delay.
TEST_F(WithoutSamples, ATriggerIsPlacedByTheCountsThatComeLateByTheDelay) {
  machine_.corrections.push(
      DelayActivated{.result_id = 1, .tau_s = {4e-3, 4e-3, 4e-3}, .sd_s = {1e-6, 1e-6, 1e-6}, .at = machine_.now});
  machine_.probe = false;
  move(5, 1);
  const double at_mm = machine_.position_mm[2] - 5 * 4e-3;
  touch();
  move(5, 0.1);
  ASSERT_EQ(last().number, 1U);
  EXPECT_NEAR(last().position_mm[2], at_mm, 2e-6);
}

TEST_F(WithoutSamples, ATriggerIsPlacedWhereTheClockIsNotLocked) {
  machine_.clock = false;
  machine_.run(1);
  touch();
  machine_.run(0.1);
  EXPECT_EQ(last().number, 1U);
  EXPECT_TRUE(last().has_position[0]);
  EXPECT_EQ(unplaced(), 0U);
}

TEST_F(WithoutSamples, ATriggerHasANumberAndNoPositionWhereNothingCounts) {
  touch();
  machine_.run(0.2);
  ASSERT_TRUE(last().has_position[2]);
  machine_.probe = false;
  machine_.encoders = false;
  machine_.run(0.1);
  touch();
  machine_.run(2);
  EXPECT_EQ(last().number, 2U);
  for (const bool known : last().has_position) EXPECT_FALSE(known);
  EXPECT_EQ(unplaced(), 1U);
}

TEST_F(WithoutSamples, EachTriggerCountsOnceWhileSamplesComeAndGo) {
  std::uint32_t given = 0;
  for (int k = 0; k < 40; ++k) {
    machine_.probe = k % 8 < 4;
    for (int i = 0; i < 5; ++i) {
      touch(microseconds{700});
      machine_.run(0.011);
    }
    while (const auto stamp = machine_.corrections.nextTrigger()) EXPECT_EQ(stamp->number, ++given);
  }
  machine_.run(0.2);
  while (const auto stamp = machine_.corrections.nextTrigger()) EXPECT_EQ(stamp->number, ++given);
  EXPECT_EQ(given, touches_);
  EXPECT_EQ(unplaced(), 0U);
}

TEST_F(WithoutSamples, TheTurningAxisIsShownAtAZThatIsKnown) {
  machine_.corrections.push(CentrelineActivated{.result_id = 4,
                                                .centre_mm = {330, 200},
                                                .slope = {1e-3, 0},
                                                .reference_z_mm = -100,
                                                .sd_centre_mm = {},
                                                .sd_slope = {},
                                                .at = machine_.now});
  machine_.run(0.1);
  const auto& centreline = machine_.snapshot().centreline;
  EXPECT_TRUE(centreline.has_z);
  EXPECT_NEAR(centreline.here_mm[0], 330, 1e-6);
  machine_.encoders = false;
  machine_.run(1.5);
  EXPECT_TRUE(centreline.has_z) << "held for 2 s";
  machine_.run(1);
  EXPECT_FALSE(centreline.has_z) << "Z may be anywhere";
  EXPECT_EQ(centreline.here_mm[0], 0);
  EXPECT_EQ(centreline.result.result_id, 4U);
  machine_.encoders = true;
  machine_.run(0.1);
  EXPECT_TRUE(centreline.has_z);
}

}  // namespace
}  // namespace probebox::corrections
