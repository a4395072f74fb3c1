#include "firmware/app/host/sample_description.hpp"

#include <chrono>
#include <gtest/gtest.h>

namespace probebox::app {
namespace {

using namespace std::chrono_literals;

constexpr MonoTime kNow{100s};

messages::Descriptor stated() {
  messages::Descriptor descriptor;
  descriptor.gain = {{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};
  descriptor.tip.ball_radius_mm = 3;
  return descriptor;
}

published::ToolInSamples homed() {
  published::ToolInSamples tool;
  for (auto& axis : tool.axes) axis = {.referenced = true, .screw_known = true, .offset_mm = 12.5};
  return tool;
}

TEST(SampleDescription, FollowsReferencesScrewsToolAndAngles) {
  SampleDescription description{stated(), {.head_swivels = true, .head_tool = 5}};
  EXPECT_TRUE(description.update({}, {}, kNow)) << "the first one is always new";
  EXPECT_FALSE(description.update({}, {}, kNow + 10s));
  EXPECT_EQ(description.descriptor().tip.referenced, 0);
  EXPECT_TRUE(description.descriptor().tip.has_deflection);

  auto tool = homed();
  EXPECT_TRUE(description.update({}, tool, kNow + 11s));
  EXPECT_EQ(description.descriptor().tip.referenced, 7);
  EXPECT_EQ(description.descriptor().tip.offset_mm[2], 12.5);
  tool.axes[1].has_screw = true;
  tool.axes[1].screw_known = false;
  EXPECT_TRUE(description.update({}, tool, kNow + 11s));
  EXPECT_EQ(description.descriptor().tip.screws_unknown, 2);
  tool.tool = 5;
  EXPECT_TRUE(description.update({}, tool, kNow + 11s));
  EXPECT_FALSE(description.descriptor().tip.has_deflection) << "the sensors of the head are on the channels";
  tool.tool = 1;
  tool.angles_rad[1] = 0.5;
  EXPECT_TRUE(description.update({}, tool, kNow + 11s));
  EXPECT_TRUE(description.descriptor().tip.turned);
  tool.angles_rad = {0.001, std::nullopt, 2.0};
  EXPECT_TRUE(description.update({}, tool, kNow + 11s));
  EXPECT_FALSE(description.descriptor().tip.turned) << "C turns the part";
}

// A screw warms up by a few nm between blocks: the book of descriptors has room for 32.
TEST(SampleDescription, FollowsAWarmScrewEveryFewSeconds) {
  SampleDescription description{stated(), {}};
  auto tool = homed();
  tool.axes[0].has_screw = true;
  ASSERT_TRUE(description.update({}, tool, kNow));
  int changes = 0;
  for (int k = 1; k <= 600; ++k) {  // a minute of blocks, 0.1 um/s
    tool.axes[0].screw_mm += 1e-5;
    if (!description.update({}, tool, kNow + k * 100ms)) continue;
    ++changes;
    EXPECT_EQ(description.descriptor().tip.screw_mm[0], tool.axes[0].screw_mm);
  }
  EXPECT_EQ(changes, 12);
  tool.axes[0].screw_slope += 1e-7;
  EXPECT_FALSE(description.update({}, tool, kNow + 100s)) << "0.1 um over a metre";
  tool.axes[0].screw_slope += 3e-7;
  EXPECT_TRUE(description.update({}, tool, kNow + 100s));
}

TEST(SampleDescription, HasTheGainOfTheDelayInForceOrThatOfTheDescription) {
  SampleDescription description{stated(), {}};
  published::DelayInForce delay{true, 4, {1e-3, 1e-3, 1e-3}, {}, published::MeasuredGain{}};
  delay.gain->value[0] = {0.98, 0.01, 0};
  delay.gain->sd[0] = {0.001, 0.002, 0.003};
  ASSERT_TRUE(description.update(delay, homed(), kNow));
  EXPECT_EQ(description.descriptor().gain[0][1], 0.01);
  EXPECT_EQ(description.descriptor().tip.gain_sd[0][2], 0.003);
  EXPECT_EQ(description.descriptor().tip.gain_result_id, 4U);
  ASSERT_TRUE(description.update({true, 5, {1e-3, 1e-3, 1e-3}, {}, std::nullopt}, homed(), kNow));
  EXPECT_EQ(description.descriptor().gain[0][0], 1);
  EXPECT_EQ(description.descriptor().tip.gain_result_id, 0U);
}

}  // namespace
}  // namespace probebox::app
