#include "firmware/corrections/trigger_log.hpp"

#include <gtest/gtest.h>
#include <rapidcheck.h>

// Every trigger has a number, and it is given out once or never; nextNumber() says which are settled.
namespace probebox::corrections {
namespace {

Edge edge(std::int64_t at_us, std::uint32_t line_sequence) {
  return {.role = LineRole::trigger, .line_sequence = line_sequence, .at = monoTime(1000 * at_us)};
}

TEST(TriggerLog, GivesATriggerOnceItsPlaceIsKnown) {
  TriggerLog log;
  log.tick({.at = monoTime(0), .position_mm = {1.0, 2.0, {}}});
  log.push(edge(500, 7), {});
  EXPECT_FALSE(log.next());
  EXPECT_EQ(log.nextNumber(), 1U) << "it will come";
  log.tick({.at = monoTime(1'000'000), .position_mm = {3.0, 2.0, {}}});
  const auto stamp = log.next();
  ASSERT_TRUE(stamp);
  EXPECT_EQ(stamp->number, 1U);
  EXPECT_EQ(stamp->line_sequence, 7U);
  EXPECT_DOUBLE_EQ(stamp->position_mm[0], 2.0);
  EXPECT_FALSE(stamp->has_position[2]);
  EXPECT_FALSE(log.next());
  EXPECT_EQ(log.nextNumber(), 2U);
}

MachineTick tickAt(std::int64_t at_us) {
  return {.at = monoTime(1000 * at_us), .position_mm = {1.0, 1.0, 1.0}};
}

TEST(TriggerLog, InterpolatesAnAngleBetweenTheLatchesOfItsEncoder) {
  TriggerLog log;
  log.tick(tickAt(0));
  log.turned(RotaryAxis::c, monoTime(0), 1.0);
  log.push(edge(500, 1), {});
  log.tick(tickAt(1000));
  EXPECT_FALSE(log.next()) << "the latch after the trigger is still to come";
  log.turned(RotaryAxis::c, monoTime(2'000'000), 1.4);
  const auto stamp = log.next();
  ASSERT_TRUE(stamp);
  EXPECT_TRUE(stamp->has_position[0]);
  EXPECT_TRUE(stamp->has_angle[2]);
  EXPECT_DOUBLE_EQ(stamp->angle_rad[2], 1.1);
  EXPECT_FALSE(stamp->has_angle[0]);
  EXPECT_EQ(log.newest().number, 1U);
}

TEST(TriggerLog, LeavesAnAngleOutWhoseEncoderIsSilentAndKeepsThePosition) {
  TriggerLog log;
  log.turned(RotaryAxis::c, monoTime(0), 1.0);
  for (std::int64_t ms = 0; ms <= 20; ++ms) {
    log.tick(tickAt(1000 * ms));
    if (ms == 1) log.push(edge(1200, 1), {});
  }
  EXPECT_FALSE(log.next()) << "a latch may still arrive";
  for (std::int64_t ms = 21; ms <= 40; ++ms) log.tick(tickAt(1000 * ms));
  const auto stamp = log.next();
  ASSERT_TRUE(stamp);
  EXPECT_TRUE(stamp->has_position[0]);
  EXPECT_FALSE(stamp->has_angle[2]);
  log.turned(RotaryAxis::c, monoTime(60'000'000), 2.0);
  log.push(edge(59'000, 2), {});
  log.tick(tickAt(58'500));
  log.tick(tickAt(60'000));
  const auto later = log.next();
  ASSERT_TRUE(later);
  EXPECT_FALSE(later->has_angle[2]) << "60 ms between two latches are too many";
}

TEST(TriggerLog, TakesAnAngleThatTheControllerToldUnlessItIsInDoubt) {
  TriggerLog log;
  MachineTick tick = tickAt(0);
  tick.angles[1] = {.rad = -0.5};
  tick.angles[2] = {.rad = 0.25, .doubtful = true};
  log.tick(tick);
  log.push(edge(500, 1), {});
  log.tick(tickAt(1000));
  const auto stamp = log.next();
  ASSERT_TRUE(stamp);
  EXPECT_TRUE(stamp->has_angle[1]);
  EXPECT_EQ(stamp->angle_rad[1], -0.5);
  EXPECT_FALSE(stamp->has_angle[2]);
}

TEST(TriggerLog, GivesEachNumberOnceOrNeverAndSaysWhichAreSettled) {
  EXPECT_TRUE(rc::check("given in order, none after it was settled, all settled in the end", [] {
    TriggerLog log;
    std::uint32_t pushed = 0, given = 0, newest = 0, settled = 1;
    std::int64_t at_us = 0;
    const auto takeAll = [&] {
      while (const auto stamp = log.next()) {
        RC_ASSERT(stamp->number > newest);
        RC_ASSERT(stamp->number >= settled);
        newest = stamp->number;
        ++given;
      }
      RC_ASSERT(log.nextNumber() >= settled);
      RC_ASSERT(log.nextNumber() > newest);
      settled = log.nextNumber();
    };
    for (int k = 0; k < 60; ++k) {
      for (int burst = *rc::gen::weightedElement<int>({{6, 0}, {6, 1}, {2, 5}, {1, 40}}); burst > 0; --burst)
        log.push(edge(at_us += 3, ++pushed), {});
      if (*rc::gen::inRange(0, 3) != 0)
        log.tick({.at = monoTime(1000 * (at_us += 200)), .position_mm = {1.0, 1.0, 1.0}});
      if (*rc::gen::inRange(0, 4) != 0) takeAll();
    }
    log.tick({.at = monoTime(1000 * (at_us + 1000)), .position_mm = {1.0, 1.0, 1.0}});
    takeAll();
    RC_ASSERT(settled == pushed + 1);
    RC_ASSERT(given <= pushed);
  }));
}

}  // namespace
}  // namespace probebox::corrections
