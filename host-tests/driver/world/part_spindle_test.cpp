#include <cmath>
#include <gtest/gtest.h>
#include <numbers>

#include "ball_on_rim.hpp"
#include "streams.hpp"

// What is done with the part's spindle: its balls in other mounts, and C until a ball touches.
namespace probebox::world {
namespace {

using testing::seconds;
using testing::withABall;

// The ball's centre from a touch of its top, by a stylus ball of 3 mm.
std::optional<Vector3> topAt(Machine& machine, const Vector3& ball, double from_s) {
  const auto count = machine.stylus().contactCount();
  const Vector3 above = ball + Vector3{0, 0, 40};
  EXPECT_TRUE(machine.moveTo({above[0], above[1], 60}, 100, seconds(from_s)));
  EXPECT_TRUE(machine.moveTo(ball + Vector3{0, 0, 8.5}, 100, seconds(from_s + 10)));
  EXPECT_TRUE(machine.moveTo({above[0], above[1], 60}, 100, seconds(from_s + 20)));
  const auto* contact = machine.stylus().contact(count);
  return contact != nullptr ? std::optional{contact->point - 9.0 * contact->normal} : std::nullopt;
}

TEST(PartSpindle, HasItsBallsInTheMountThatTheyWerePutIn) {
  Config config = withABall();
  config.part_spindle.further_mounts = {{.turn_rad = {0, 0, std::numbers::pi / 2}, .shift_mm = {0, 0, 5}}};
  Machine machine{config};
  EXPECT_FALSE(machine.mountBalls(3, seconds(1))) << "there is no such mount";
  EXPECT_EQ(machine.mount(), 1U);
  ASSERT_TRUE(topAt(machine, {300, 110, -20}, 2));
  ASSERT_TRUE(machine.mountBalls(2, seconds(40)));
  EXPECT_FALSE(machine.atRest(seconds(45))) << "somebody is at it";
  EXPECT_FALSE(topAt(machine, {300, 110, -20}, 60));
  const auto moved = topAt(machine, {240, 50, -15}, 100);
  ASSERT_TRUE(moved);
  for (std::size_t i = 0; i < 3; ++i) EXPECT_NEAR((*moved)[i], (Vector3{240, 50, -15})[i], 1e-9);
  EXPECT_EQ(machine.crashes(), 0U);
}

TEST(PartSpindle, TurnsUntilItsBallTouchesAndStopsThere) {
  Machine machine{withABall()};
  ASSERT_TRUE(machine.turnTo({.c_rad = 0.5}, seconds(1)));
  ASSERT_TRUE(machine.moveTo({315, 110, -20}, 50, seconds(10)));
  ASSERT_TRUE(machine.turnUntilContact(-0.5, 0.1, seconds(30)));
  ASSERT_EQ(machine.stylus().contactCount(), 1U);
  const auto& contact = *machine.stylus().contact(0);
  const double c_rad = machine.commandedPose().c_rad;
  const Vector3 ball{300 - 60 * std::sin(c_rad), 50 + 60 * std::cos(c_rad), -20};
  EXPECT_NEAR(norm(ball - Vector3{315, 110, -20}), 9, 1e-6) << "ball and stylus ball";
  EXPECT_NEAR(toSeconds(contact.begin.rounded() - seconds(30)), (0.5 - c_rad) / 0.1, 1e-6);
  EXPECT_NEAR(machine.partAngleAt(seconds(31)), 0.4, 1e-9);
  EXPECT_FALSE(machine.turnUntilContact(-1, 0.1, seconds(60))) << "it touches already";
  ASSERT_TRUE(machine.turnTo({.c_rad = 0.5}, seconds(60)));
  EXPECT_EQ(machine.stylus().contact(0)->end->rounded(), seconds(60));
  ASSERT_TRUE(machine.turnUntilContact(1, 0.1, seconds(80)));
  EXPECT_EQ(machine.stylus().contactCount(), 1U) << "nothing is on that way";
  EXPECT_EQ(machine.commandedPose().c_rad, 1);
  EXPECT_EQ(machine.crashes(), 0U);
}

}  // namespace
}  // namespace probebox::world
