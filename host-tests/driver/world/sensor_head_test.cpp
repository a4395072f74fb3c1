#include "drivers/world/sensor_head.hpp"

#include <algorithm>
#include <cmath>
#include <gtest/gtest.h>
#include <optional>

#include "streams.hpp"

// A sensor head in the place of the probe: what its sensors say of the ball that is nearest.
namespace probebox::world {
namespace {

using testing::pollAll;
using testing::quiet;
using testing::seconds;

constexpr Matrix3 kSensors{{{0.8, 0, 0.6}, {-0.4, 0.7, 0.5}, {-0.4, -0.7, 0.6}}};

Config withHead() {
  Config config = quiet();
  config.sphere = {.centre_mm = {0, 0, 0}, .radius_mm = 12.5, .stylus_ball_radius_mm = 3};
  config.part_spindle.point_mm = {100, 0, 0};
  config.part_spindle.balls_mm = {{20, 0, 0}};
  config.probe_spindle.stylus_length_mm = 150;
  config.further_tools = {{.number = 5,
                           .offset_mm = {0.5, -0.25},
                           .length_mm = 180,
                           .radius_mm = {},
                           .head = board::WorldSensorHead{.sensors = kSensors, .range_mm = 0.5, .noise_um = 0}}};
  config.axes.home_mm = {0, 0, 100};
  return config;
}

// Where the machine stands when the head is `from` the centre of a ball.
Vector3 placeOver(const Vector3& ball, const Vector3& from = {}) {
  return ball + from - Vector3{0.5, -0.25, -30};
}

class HeadWorld : public ::testing::Test {
 protected:
  void start(const Config& config) { world_.emplace(config, 1); }
  void take(std::uint32_t tool) {
    ASSERT_TRUE(world_->machine().takeTool(tool, seconds(now_s_)));
    wait(3.1);
  }
  void goTo(const Vector3& target) {
    ASSERT_TRUE(world_->machine().moveTo(target, 100, seconds(now_s_)));
    wait(norm(target - from_) / 100 + 0.5);
    from_ = target;
  }
  void wait(double s) {
    now_s_ += s;
    world_->advanceTo(seconds(now_s_));
    pollAll(*world_, events_);
  }
  // The last sample.
  Deflection sample() const { return testing::takeApart(events_).deflections.back(); }
  void expectSensors(const Vector3& ball_from_head) const {
    const Vector3 said = kSensors * ball_from_head;
    for (std::size_t i = 0; i < 3; ++i) EXPECT_NEAR(1e-6 * sample().channels_nm[i], said[i], 2e-6) << i;
    EXPECT_FALSE(sample().clipped);
  }

  std::optional<World> world_;
  std::vector<Event> events_;
  double now_s_{1};
  Vector3 from_{0, 0, 100};
};

TEST_F(HeadWorld, ReadsTheBallThatIsNearestAndTouchesNothing) {
  start(withHead());
  take(5);
  goTo(placeOver({0, 0, 0}, {0, 0, 100}));
  goTo(placeOver({0, 0, 0}, {0.1, -0.05, 0.2}));
  expectSensors({-0.1, 0.05, -0.2});
  goTo(placeOver({0, 0, 0}));
  expectSensors({});
  goTo(placeOver({0, 0, 0}, {0, 0, 100}));
  goTo(placeOver({120, 0, 0}, {0, 0, 100}));
  goTo(placeOver({120, 0, 0}, {0, 0.3, 0}));
  expectSensors({0, -0.3, 0});
  EXPECT_EQ(world_->machine().stylus().contactCount(), 0U);
  EXPECT_EQ(world_->machine().crashes(), 0U);
}

TEST_F(HeadWorld, StandsAtTheEndOfItsRangeAwayFromBalls) {
  start(withHead());
  take(5);
  EXPECT_TRUE(sample().clipped);
  EXPECT_EQ(std::abs(sample().channels_nm[2]), 500'000);
  goTo(placeOver({0, 0, 0}, {0, 0, 100}));
  goTo(placeOver({0, 0, 0}, {0, 0, -0.9}));
  EXPECT_TRUE(sample().clipped) << "the first sensor would read 0.54 mm";
  EXPECT_EQ(sample().channels_nm[0], 500'000);
  EXPECT_LT(sample().channels_nm[1], 500'000);
}

TEST_F(HeadWorld, TurnsWithItsSpindleAndFollowsThePart) {
  start(withHead());
  take(5);
  ASSERT_TRUE(world_->machine().turnTo({.a_rad = M_PI / 2, .c_rad = M_PI}, seconds(now_s_)));
  wait(2);
  // C has carried the ball to the other side; A has turned the head's X to the machine's Y, and its offset.
  const Vector3 ball{80, 0, 0};
  goTo(ball + Vector3{0, 0, 100});
  goTo(ball - Vector3{0.25, 0.5, -30} + Vector3{0, 0.2, 0});
  expectSensors({-0.2, 0, 0});
}

TEST_F(HeadWorld, GivesTheChannelsBackToTheProbe) {
  start(withHead());
  take(5);
  EXPECT_TRUE(sample().clipped);
  take(1);
  EXPECT_EQ(sample().channels_nm, (std::array<std::int32_t, 3>{}));
  EXPECT_FALSE(sample().clipped);
}

TEST_F(HeadWorld, CrashesWhenItComesFromAsideOrTheBallIsTurnedAway) {
  start(withHead());
  take(5);
  goTo(placeOver({0, 0, 0}, {0, 0, 50}));
  goTo(placeOver({0, 0, 0}));
  EXPECT_EQ(world_->machine().crashes(), 0U);
  goTo(placeOver({0, 0, 0}, {0, 0, 50}));
  goTo(placeOver({0, 0, 0}, {40, 0, 50}));
  goTo(placeOver({0, 0, 0}, {40, 0, 0}));
  goTo(placeOver({0, 0, 0}));
  EXPECT_EQ(world_->machine().crashes(), 1U) << "into its side";
  goTo(placeOver({0, 0, 0}, {0, 0, 50}));
  goTo(placeOver({120, 0, 0}, {0, 0, 50}));
  goTo(placeOver({120, 0, 0}));
  ASSERT_TRUE(world_->machine().turnTo({.c_rad = 1}, seconds(now_s_)));
  EXPECT_EQ(world_->machine().crashes(), 2U) << "the ball is in the head while C turns";
}

TEST_F(HeadWorld, SaysTheSameHoweverLateItIsAsked) {
  const auto streamOf = [](double step_s) {
    Config config = withHead();
    config.delays.tau_probe_s = 0.02;
    World world{config, 3};
    std::vector<Event> events;
    const auto wait_until = [&](double from_s, double to_s) {
      for (double t = from_s + step_s; t < to_s + step_s / 2; t += step_s) {
        world.advanceTo(seconds(std::min(t, to_s)));
        pollAll(world, events);
      }
    };
    // The change begins on a multiple of either step.
    wait_until(0, 1);
    world.machine().takeTool(5, seconds(1));
    wait_until(1, 5);
    world.machine().takeTool(1, seconds(5));
    wait_until(5, 6);
    return testing::takeApart(events).deflections;
  };
  const auto often = streamOf(0.01), seldom = streamOf(1.0);
  ASSERT_EQ(often.size(), seldom.size());
  const auto clipped = [](const Deflection& d) { return d.clipped; };
  EXPECT_NEAR(static_cast<double>(std::ranges::count_if(often, clipped)), 4000, 2);
  for (std::size_t i = 0; i < often.size(); ++i) ASSERT_EQ(often[i].channels_nm, seldom[i].channels_nm) << i;
}

}  // namespace
}  // namespace probebox::world
