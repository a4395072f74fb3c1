#include <cmath>
#include <gtest/gtest.h>
#include <numbers>

#include "host-tests/emulation/scenario.hpp"

// Step 2 of a large lathe (CN101976057, metrology B25): the stylus stands at equal heights on either side of the line,
// and C turns until its ball touches. The stamps of the trigger say where C was.
namespace probebox::scenario {
namespace {

using namespace std::chrono_literals;
using world::Vector3;
using world::operator+;
using world::operator-;

constexpr double kDegree = std::numbers::pi / 180;
constexpr double kRim_mm = 60;
constexpr double kSpeed_rad_s = 0.05;

class TurnedUntilContact : public testing::TestWithParam<std::uint64_t> {
 protected:
  // The ball of the rim is 0.9 degrees away from the line along +Y when C stands at 0.
  static constexpr double kOff_rad = 0.9 * kDegree;

  static world::Config rimWorld() {
    auto config = usualWorld();
    config.part_spindle.direction = {0, 0, 1};
    config.part_spindle.ball_count = 1;
    config.part_spindle.balls_mm[0] = {kRim_mm * std::sin(kOff_rad), kRim_mm * std::cos(kOff_rad), 20};
    config.rotary.noise_rad = 0;
    config.probe_spindle.stylus_offset_mm = {0, 0};
    return config;
  }

  const world::Config config{rimWorld()};
  Scenario scenario{config, GetParam()};
  double struck_rad{};  // where C really was when the ball touched

  world::Machine& machine() { return scenario.world().machine(); }
  void standStill() {
    ASSERT_TRUE(scenario.runUntil([this] { return machine().atRest(scenario.now()); }, 60s));
    scenario.run(100ms);
  }
  void moveBy(const Vector3& mm) {
    ASSERT_TRUE(machine().moveTo(machine().commandedPosition() + mm, 100, scenario.now()));
    standStill();
  }

  // Beside the nominal line by this, at the height of the ball.
  published::TriggerStamp touchBeside(double x_mm) {
    scenario.run(2s);
    const Vector3 beside = config.part_spindle.point_mm + Vector3{x_mm, kRim_mm, 20};
    const double sense = x_mm > 0 ? 1 : -1;
    moveBy({0, 0, 100});
    EXPECT_TRUE(machine().turnTo({.c_rad = sense * 20 * kDegree}, scenario.now()));
    standStill();
    const Vector3 here = machine().commandedPosition();
    moveBy({beside[0] - here[0], beside[1] - here[1], 0});
    moveBy({0, 0, beside[2] - machine().commandedPosition()[2]});
    const auto before = scenario.state().snapshot.last_trigger.number;
    // Clockwise is the negative sense of C.
    EXPECT_TRUE(machine().turnUntilContact(-sense * 20 * kDegree, kSpeed_rad_s, scenario.now()));
    standStill();
    struck_rad = machine().commandedPose().c_rad;
    const auto stamp = scenario.state().snapshot.last_trigger;
    EXPECT_EQ(stamp.number, before + 1);
    EXPECT_TRUE(machine().turnTo({.c_rad = sense * 20 * kDegree}, scenario.now()));
    standStill();
    return stamp;
  }
};

TEST_P(TurnedUntilContact, HasTheAngleOfCAtItsStampAndTheBallOnTheLineInTheMiddle) {
  double sum_rad = 0;
  for (const double x_mm : {15.0, -15.0}) {
    const auto stamp = touchBeside(x_mm);
    ASSERT_TRUE(stamp.has_angle[2]);
    EXPECT_FALSE(stamp.has_angle[0]) << "no encoder says how A stands";
    // The encoder is late, and the trigger a little.
    const double lag_rad = kSpeed_rad_s * (scenario.truth().tau_s[2] - 1e-6 * config.sync.bias_us);
    EXPECT_NEAR(stamp.angle_rad[2], struck_rad + (x_mm > 0 ? lag_rad : -lag_rad), 1e-6);
    sum_rad += stamp.angle_rad[2];
  }
  // Turned back by what it is off, the ball stands on the line.
  EXPECT_NEAR(sum_rad / 2, kOff_rad, 2e-6);
  EXPECT_EQ(machine().crashes(), 0U);
}

INSTANTIATE_TEST_SUITE_P(Worlds, TurnedUntilContact, testing::Range<std::uint64_t>(1, 5));

}  // namespace
}  // namespace probebox::scenario
