#include "drivers/world/solids.hpp"

#include <algorithm>
#include <cmath>
#include <gtest/gtest.h>
#include <numbers>
#include <optional>

#include "drivers/world/machine.hpp"
#include "drivers/world/random.hpp"
#include "streams.hpp"

// The shank above the stylus' ball: where it meets balls, and what the probe says of it.
namespace probebox::world {
namespace {

using testing::pollAll;
using testing::quiet;
using testing::seconds;

constexpr double kBall_mm = 12.5;
constexpr double kLever = 1.4;

// A sphere in the origin, and a shank that leans and runs out.
Config withShank() {
  Config config = quiet();
  config.sphere = {.centre_mm = {0, 0, 0}, .radius_mm = kBall_mm, .stylus_ball_radius_mm = 3};
  config.probe_spindle.stylus_offset_mm = {0.021, -0.013};
  config.probe_spindle.shank = board::WorldShank{.radius_mm = 5,
                                                 .from_mm = 30,
                                                 .to_mm = 80,
                                                 .offset_mm = {0.034, 0.027},
                                                 .lean = {0.002, -0.001},
                                                 .lever = kLever};
  config.axes.home_mm = {0, 0, 100};
  return config;
}

// Whether a shank with its ball's centre at `tip` reaches into the sphere: by many points of its axis.
bool reaches(const Shank& shank, const Vector3& tip, const Vector3& ball) {
  constexpr int kPoints = 20'000;
  double nearest_mm = 1e9;
  for (int i = 0; i <= kPoints; ++i) {
    const Vector3 on_axis = tip + shank.low + static_cast<double>(i) / kPoints * (shank.high - shank.low);
    nearest_mm = std::min(nearest_mm, norm(on_axis - ball));
  }
  return nearest_mm < kBall_mm + shank.radius_mm;
}

TEST(Shank, MeetsABallWhereItFirstComesIntoIt) {
  Random random{5, 1};
  int met = 0;
  for (int trial = 0; trial < 60; ++trial) {
    const auto some = [&](double most) { return random.uniform(-most, most); };
    const Shank shank{.low = {some(1), some(1), 20}, .high = {some(8), some(8), 70}, .radius_mm = 5, .lever = 2};
    const Vector3 ball{some(3), some(3), some(3)};
    const Vector3 aim{some(15), some(15), -45 + some(40)}, direction = unit({some(1), some(1), some(0.5)});
    const Move way{.start = {}, .from = aim - 120 * direction, .direction = direction, .length_mm = 240, .profile = {}};
    const auto meeting = shank.meet(way, ball, kBall_mm);
    if (!meeting) {
      for (int i = 0; i <= 120; ++i) EXPECT_FALSE(reaches(shank, way.at(2.0 * i), ball)) << trial;
      continue;
    }
    ++met;
    EXPECT_FALSE(reaches(shank, way.at(meeting->distance_mm - 1e-3), ball)) << trial;
    EXPECT_TRUE(reaches(shank, way.at(meeting->distance_mm + 1e-2), ball)) << trial;
    EXPECT_EQ(shank.strikes(way.at(meeting->distance_mm + 1e-2), ball, kBall_mm), true);
    EXPECT_EQ(shank.strikes(way.at(meeting->distance_mm - 1e-2), ball, kBall_mm), false);
    EXPECT_LT(dot(meeting->normal, direction), 0) << "outward, against the way";
    EXPECT_EQ(meeting->lever, 2);
  }
  EXPECT_GT(met, 20);
  EXPECT_LT(met, 60);
}

class ShankWorld : public ::testing::Test {
 protected:
  void goTo(const Vector3& target, double speed_mm_s = 100) {
    ASSERT_TRUE(world_.machine().moveTo(target, speed_mm_s, seconds(now_s_)));
    wait(norm(target - from_) / speed_mm_s + 0.5);
    from_ = target;
  }
  void turn(double a_rad) {
    ASSERT_TRUE(world_.machine().turnTo({.a_rad = a_rad}, seconds(now_s_)));
    wait(3);
  }
  void wait(double s) {
    now_s_ += s;
    world_.advanceTo(seconds(now_s_));
    pollAll(world_, events_);
  }
  // Comes down beside the sphere with the shank at its height, touches it from that side and stays 0.5 mm deep. Where
  // the machine stood at contact, along that side.
  double touchFrom(const Vector3& side) {
    goTo({40 * side[0], 40 * side[1], 100});
    goTo(40 * side + Vector3{0, 0, -50});
    const auto before = world_.machine().stylus().contactCount();
    const Vector3 deep = 17 * side + Vector3{0, 0, -50};
    goTo(deep, 10);
    EXPECT_EQ(world_.machine().stylus().contactCount(), before + 1);
    const auto* contact = world_.machine().stylus().contact(before);
    return contact == nullptr ? 0 : dot(contact->point - contact->tip, side);
  }
  void leave() {
    goTo(2 * Vector3{from_[0], from_[1], -25});
    goTo({from_[0], from_[1], 100});
  }

  Config config_{withShank()};
  World world_{config_, 1};
  std::vector<Event> events_;
  double now_s_{1};
  Vector3 from_{0, 0, 100};
};

// (B16): from opposite sides with half a turn in between, radii and run-out cancel.
TEST_F(ShankWorld, RunsOutAsItLeans) {
  // 20 mm above where it begins.
  const auto& shank = *config_.probe_spindle.shank;
  for (const std::size_t axis : {0U, 1U}) {
    Vector3 side{};
    side[axis] = 1;
    const double runs_out_mm = shank.offset_mm[axis] + 20 * shank.lean[axis];
    const double at_zero_mm = touchFrom(side);
    leave();
    turn(std::numbers::pi);
    const double opposite_mm = -touchFrom(-side), same_mm = (leave(), touchFrom(side));
    leave();
    turn(0);
    EXPECT_NEAR(at_zero_mm, 17.5 - runs_out_mm, 2e-4);
    EXPECT_NEAR(same_mm, 17.5 + runs_out_mm, 2e-4);
    EXPECT_NEAR((at_zero_mm + opposite_mm) / 2, 0, 2e-4);
  }
  EXPECT_EQ(world_.machine().crashes(), 0U);
}

TEST_F(ShankWorld, MovesTheStylusBallByMoreThanItIsMovedItself) {
  const double contact_mm = touchFrom({1, 0, 0});
  const auto sample = testing::takeApart(events_).deflections.back();
  const Vector3 moved{kLever * (contact_mm - 17), 0, 0};
  const Vector3 channels = inverse(config_.probe.gain) * moved;
  for (std::size_t i = 0; i < 3; ++i) EXPECT_NEAR(1e-6 * sample.channels_nm[i], channels[i], 3e-3) << i;
  leave();
  EXPECT_NEAR(1e-6 * testing::takeApart(events_).deflections.back().channels_nm[0], 0, 2e-6);
}

TEST_F(ShankWorld, LeavesATouchOfTheStylusBallAlone) {
  goTo({40, 0, 100});
  goTo({40, 0, 0});
  goTo({15, 0, 0}, 10);
  const auto* contact = world_.machine().stylus().contact(0);
  ASSERT_NE(contact, nullptr);
  EXPECT_EQ(contact->lever, 1);
  EXPECT_NEAR(contact->point[0], 15.5, 1e-4);
}

TEST_F(ShankWorld, CrashesWhereItTurnsAgainstABall) {
  config_.probe_spindle.shank->offset_mm = {0.5, 0};
  world_ = World{config_, 1};
  goTo({40, 0, 100});
  goTo({40, 0, -50});
  goTo({17.3, 0, -50});
  EXPECT_EQ(world_.machine().crashes(), 0U);
  turn(std::numbers::pi);
  EXPECT_EQ(world_.machine().crashes(), 1U);
}

}  // namespace
}  // namespace probebox::world
