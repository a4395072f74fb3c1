#include "drivers/world/world.hpp"

#include <cstring>
#include <gtest/gtest.h>

#include "streams.hpp"

namespace probebox::world {
namespace {

using testing::pollAll;
using testing::seconds;

std::vector<std::byte> bytesOf(const std::vector<Event>& events) {
  std::vector<std::byte> bytes;
  for (const Event& event : events) {
    std::visit(
        [&]<class E>(const E& e) {
          E::fields(e, [&](auto, const auto& value, auto) {
            const auto* first = reinterpret_cast<const std::byte*>(&value);
            bytes.insert(bytes.end(), first, first + sizeof value);
          });
        },
        event);
  }
  return bytes;
}

Config lively() {
  Config config = testing::usual();
  config.clock.missing_probability = config.clock.doubled_probability = config.clock.spurious_probability = 0.003;
  config.probe.dropout_probability = config.encoders.dropout_probability = 0.002;
  config.trigger_line = true;
  return config;
}

// Three seconds with one touch and a fault, time advanced and events polled in steps of any size.
std::vector<Event> history(const Config& config, std::uint64_t seed, int step_ms, std::size_t chunk) {
  World world{config, seed};
  world.inject({.kind = FaultKind::sync_silent, .at = seconds(1.2), .duration = std::chrono::milliseconds{30}});
  std::vector<Event> events;
  for (int ms = 0; ms <= 3000; ms += step_ms) {
    if (ms == 600) world.machine().moveTo({10, -20, 45}, 100, seconds(0.6));
    if (ms == 1800) world.machine().moveTo({10, -20, 47}, 20, seconds(1.8));
    world.advanceTo(seconds(1e-3 * ms));
    pollAll(world, events, chunk);
  }
  return events;
}

TEST(World, IsTheSameForASeedHoweverItIsAsked) {
  const auto reference = bytesOf(history(lively(), 42, 1, 64));
  EXPECT_GT(reference.size(), 100'000U);
  for (const auto& [step_ms, chunk] : {std::pair{1, 64U}, {5, 1U}, {600, 7U}, {200, 1000U}}) {
    EXPECT_EQ(bytesOf(history(lively(), 42, step_ms, chunk)), reference) << step_ms << " ms, " << chunk;
  }
}

TEST(World, DiffersForAnotherSeed) {
  EXPECT_NE(bytesOf(history(lively(), 42, 5, 64)), bytesOf(history(lively(), 43, 5, 64)));
}

TEST(World, HandsEventsOutInTheOrderOfTheirStampsAndNeverEarly) {
  World world{lively(), 1};
  std::vector<Event> events;
  MonoTime last{};
  for (int ms = 1; ms < 5000; ++ms) {
    world.advanceTo(seconds(1e-3 * ms));
    events.clear();
    pollAll(world, events);
    for (const Event& event : events) {
      ASSERT_GE(stampOf(event), last);
      ASSERT_LE(stampOf(event), world.now());
      last = stampOf(event);
    }
  }
}

TEST(World, BeginsWhenItIsTold) {
  Config config = testing::usual();
  config.start = seconds(86'400);
  World world{config, 1};
  std::vector<Event> events;
  world.advanceTo(seconds(86'401));
  pollAll(world, events);
  EXPECT_GE(stampOf(events.front()), config.start);
  EXPECT_NEAR(static_cast<double>(events.size()), 1000 + 1000 + 1500, 4);
}

TEST(World, TellsItsTruth) {
  Config config = testing::usual();
  config.delays = {{0.004, 0.005, 0.003}, 0.0005};
  const Truth truth = World{config, 1}.truth();
  EXPECT_DOUBLE_EQ(truth.tau_s[0], 0.0035);
  EXPECT_DOUBLE_EQ(truth.tau_s[1], 0.0045);
  EXPECT_DOUBLE_EQ(truth.tau_s[2], 0.0025);
  EXPECT_EQ(truth.sphere_centre_mm, (Vector3{10, -20, 30}));
  EXPECT_DOUBLE_EQ(truth.effective_radius_mm, 15.5);
  EXPECT_EQ(truth.gain, config.probe.gain);
}

TEST(World, KnowsWhenEveryRecentTickWas) {
  Config config = testing::quiet();
  config.clock.drift_ppm = 50;
  World world{config, 1};
  std::vector<Event> events;
  world.advanceTo(seconds(10));
  pollAll(world, events);
  const auto ticks = static_cast<std::int64_t>(world.truth().ledger.ticks);
  EXPECT_FALSE(world.trueTick(Tick{ticks - 5000}));
  EXPECT_FALSE(world.trueTick(Tick{ticks + 1}));
  const auto earlier = world.trueTick(Tick{ticks - 2001}), later = world.trueTick(Tick{ticks - 1});
  ASSERT_TRUE(earlier && later);
  EXPECT_NEAR(static_cast<double>((later->at - earlier->at).count()), 2000 * 1'000'050.0, 1);
  EXPECT_DOUBLE_EQ(later->period_ns, 1'000'050);
}

TEST(World, CountsTheTimesOfDescribedFaultsFromItsStart) {
  const MonoTime start{std::chrono::seconds{100}};
  const auto silent = faultFrom(start, {.kind = FaultKind::sync_silent, .at_s = 4, .lasts_s = 2, .jump_s = 0});
  EXPECT_EQ(silent.kind, FaultKind::sync_silent);
  EXPECT_EQ(silent.at, start + std::chrono::seconds{4});
  EXPECT_EQ(silent.duration, std::chrono::seconds{2});
  const auto jump = faultFrom(start, {.kind = FaultKind::clock_jumps, .at_s = 5, .lasts_s = 0, .jump_s = -300e-6});
  EXPECT_EQ(jump.jump, std::chrono::microseconds{-300});
}

}  // namespace
}  // namespace probebox::world
