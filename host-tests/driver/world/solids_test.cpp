#include "drivers/world/solids.hpp"

#include <cmath>
#include <gtest/gtest.h>
#include <optional>

#include "drivers/world/machine.hpp"
#include "streams.hpp"

namespace probebox::world {
namespace {

using testing::seconds;

// A ball on a leaning part spindle, plates beside, and a stylus that is off its own spindle's axis.
Config furnished() {
  Config config = testing::quiet();
  config.plates[0] =
      board::WorldPlates{.middle_mm = {100, 0, 20}, .gap_mm = 20, .width_mm = 30, .height_mm = 30, .thickness_mm = 8};
  config.part_spindle.point_mm = {300, 50, -40};
  config.part_spindle.direction = {0.002, -0.003, 1};
  config.part_spindle.balls_mm = {{30, 0, 60}};
  config.probe_spindle.direction = {0.001, 0, 1};
  config.probe_spindle.stylus_offset_mm = {0.5, -0.25};
  config.probe_spindle.stylus_length_mm = 100;
  config.axes.home_mm = {300, 50, 110};
  return config;
}

// One movement after the other, each with all the time that it takes.
class Driver {
 public:
  explicit Driver(const Config& config) : machine{config} {}

  void turn(double a_rad, double c_rad) { EXPECT_TRUE(machine.turnTo({.a_rad = a_rad, .c_rad = c_rad}, next())); }
  void go(const Vector3& target) { EXPECT_TRUE(machine.moveTo(target, 50, next())); }
  // The contact of a drive from one place to another and back; nothing when the way was free.
  std::optional<Contact> touch(const Vector3& from, const Vector3& to) {
    go({from[0], from[1], 110});
    go(from);
    const auto before = machine.stylus().contactCount();
    go(to);
    std::optional<Contact> contact;
    if (machine.stylus().contactCount() > before) contact = *machine.stylus().contact(before);
    go(from);
    go({from[0], from[1], 110});
    return contact;
  }

  Machine machine;

 private:
  MonoTime next() { return seconds(t_ += 30); }
  double t_{};
};

TEST(Solids, ABallTurnsAboutItsLeaningAxis) {
  const Config config = furnished();
  Driver driver{config};
  const Vector3 along = unit(config.part_spindle.direction);
  for (const double c_rad : {0.0, 0.7, 2.0, 3.9, 5.5}) {
    driver.turn(0, c_rad);
    const Vector3 about{300 + 30 * std::cos(c_rad), 50 + 30 * std::sin(c_rad), 20};
    for (const Vector3& side : {Vector3{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, 0, 1}}) {
      const auto contact = driver.touch(about + 12.0 * side, about + 8.0 * side);
      ASSERT_TRUE(contact);
      // From the surface along its normal to the centre: always as far along the axis and as far off it.
      const Vector3 from_axis = contact->point - 9.0 * contact->normal - config.part_spindle.point_mm;
      const double height = dot(from_axis, along);
      EXPECT_NEAR(height, dot({30, 0, 60}, along), 1e-9);
      EXPECT_NEAR(norm(from_axis - height * along), norm(Vector3{30, 0, 60} - height * along), 1e-9);
      EXPECT_NEAR(norm(contact->normal), 1, 1e-12);
    }
  }
  EXPECT_EQ(driver.machine.crashes(), 0U);
}

TEST(Solids, ATableTiltsTheSpindleWithAllThatStandsOnIt) {
  Config config = furnished();
  config.tilting_table = board::WorldTiltingTable{.point_mm = {0, 60, -20}, .direction = {1, 0.001, -0.002}};
  const Machine machine{config};
  const Vector3 along = unit(config.tilting_table->direction);
  const Vector3 ball = config.part_spindle.point_mm + config.part_spindle.balls_mm[0];
  for (const double c_rad : {0.0, 2.0}) {
    const Vector3 level = machine.partPoint(ball, {.c_rad = c_rad});
    const Vector3 arm = level - config.tilting_table->point_mm;
    const Vector3 tilted = machine.partPoint(ball, {.c_rad = c_rad, .tilt_rad = 0.5}) - config.tilting_table->point_mm;
    EXPECT_NEAR(dot(tilted, along), dot(arm, along), 1e-9) << "as far along the axis";
    const Vector3 from = arm - dot(arm, along) * along, to = tilted - dot(tilted, along) * along;
    EXPECT_NEAR(norm(to), norm(from), 1e-9) << "and as far from it";
    EXPECT_NEAR(std::atan2(dot(cross(from, to), along), dot(from, to)), 0.5, 1e-12) << "right-handed";
  }
  // The ball comes down on a stylus that waits beside it.
  Machine waiting{config};
  ASSERT_TRUE(waiting.moveTo({330, 90, 0}, 50, seconds(1)));
  ASSERT_TRUE(waiting.turnTo({.table_rad = -1.5}, seconds(30)));
  EXPECT_EQ(waiting.crashes(), 1U);
}

TEST(Solids, AHeadSwivelsTheStylusAboutItsAxisWhateverTheTool) {
  Config config = furnished();
  config.swivel_head = board::WorldSwivelHead{.pivot_mm = {0.5, 0, 70}, .direction = {0, 1, 0.002}, .noise_rad = 0};
  config.further_tools = {{.number = 7, .offset_mm = {0, 0.1}, .length_mm = 160}};
  Machine machine{config};
  const Vector3 along = unit(config.swivel_head->direction);
  // Positions are of the stylus ball of the first tool in an ideal spindle, 100 mm below the reference.
  const Vector3 pivot = config.swivel_head->pivot_mm + Vector3{0, 0, 100};
  for (const std::uint32_t tool : {1U, 7U}) {
    const Vector3 level = machine.tipIn({}, tool) - pivot;
    const Vector3 swung = machine.tipIn({.head_rad = 0.7}, tool) - pivot;
    EXPECT_NEAR(dot(swung, along), dot(level, along), 1e-9);
    const Vector3 from = level - dot(level, along) * along, to = swung - dot(swung, along) * along;
    EXPECT_NEAR(norm(to), norm(from), 1e-9);
    EXPECT_NEAR(std::atan2(dot(cross(from, to), along), dot(from, to)), 0.7, 1e-12);
  }
  EXPECT_NEAR(machine.tipIn({}, 7)[2], -60, 1e-12);
  EXPECT_NEAR(machine.tipIn({}, 7)[1], 0.1, 1e-12);

  EXPECT_EQ(machine.tool(), 1U);
  EXPECT_FALSE(machine.takeTool(5, seconds(1))) << "there is none of that number";
  EXPECT_TRUE(machine.takeTool(7, seconds(1)));
  EXPECT_FALSE(machine.atRest(seconds(2))) << "a change takes its time";
  EXPECT_FALSE(machine.takeTool(1, seconds(2)));
  EXPECT_EQ(machine.tool(), 7U);
  // 60 mm longer, so the ball of the part is met so much higher.
  ASSERT_TRUE(machine.turnTo({.c_rad = 0}, seconds(20)));
  ASSERT_TRUE(machine.moveTo({330, 50, 110}, 50, seconds(30)));
  ASSERT_TRUE(machine.moveTo({330, 50, 86}, 50, seconds(60)));
  ASSERT_EQ(machine.stylus().contactCount(), 1U);
  EXPECT_NEAR(machine.stylus().contact(0)->point[2], 29, 0.1);
  // A probe whose head lies on its side feels a push along Z as one along its own X.
  Machine lying{config};
  ASSERT_TRUE(lying.turnTo({.head_rad = M_PI / 2}, seconds(1)));
  const Vector3 tip = lying.tipIn({.head_rad = M_PI / 2}, 1), above{330, 50, 40};
  ASSERT_TRUE(lying.moveTo(Vector3{330, 50, 200} - tip, 50, seconds(20)));
  ASSERT_TRUE(lying.moveTo(above - tip, 50, seconds(50)));
  ASSERT_TRUE(lying.moveTo(above - tip - Vector3{0, 0, 11.5}, 50, seconds(70)));
  ASSERT_EQ(lying.stylus().contactCount(), 1U);
  const Vector3 felt = lying.probeDisplacementAt(seconds(90), 0);
  EXPECT_GT(std::abs(felt[0]), 0.3);
  EXPECT_LT(std::abs(felt[2]), 0.05);
}

TEST(Solids, PlatesAreMetFromWithinTheGapAndFromOutside) {
  Driver driver{furnished()};
  const double free_mm = 10 - 3;  // from the middle to where the stylus ball's centre meets a face
  for (const double side : {-1.0, 1.0}) {
    const auto inside = driver.touch({100, 0, 20}, {100 + 8 * side, 0, 20});
    ASSERT_TRUE(inside);
    EXPECT_NEAR(inside->point[0], 100 + free_mm * side, 1e-9);
    EXPECT_EQ(inside->normal, (Vector3{-side, 0, 0}));
    const auto outside = driver.touch({100 + 30 * side, 0, 20}, {100 + 20 * side, 0, 20});
    ASSERT_TRUE(outside);
    EXPECT_NEAR(outside->point[0], 100 + (10 + 8 + 3) * side, 1e-9);
    EXPECT_EQ(outside->normal, (Vector3{side, 0, 0}));
  }
  EXPECT_FALSE(driver.touch({100, 60, 20}, {120, 60, 20})) << "beside the plates the way is free";
}

TEST(Solids, AHalfTurnOfTheProbesSpindleTakesTheStylusToTheOtherSide) {
  Driver driver{furnished()};
  const auto across = [&](double a_rad) {
    driver.turn(a_rad, 0);
    const auto contact = driver.touch({350, 50, 20}, {330, 50, 20});
    return contact.value();
  };
  const Contact straight = across(0), turned = across(3.141592653589793);
  EXPECT_EQ(straight.tip, (Vector3{0.5, -0.25, 0}));
  // The axis leans by 1 mrad: 100 mm below the reference the ball goes round a point that is 0.1 mm to -X.
  EXPECT_NEAR(turned.tip[0], -0.5 - 0.2, 1e-3);
  EXPECT_NEAR(turned.tip[1], 0.25, 1e-6);
  EXPECT_NEAR(turned.turned[0][0], -1, 1e-5);
}

TEST(Solids, ThePartStrikesAStylusThatStandsInItsWay) {
  Driver driver{furnished()};
  driver.go({300, 90, 110});
  driver.go({300, 80, 20});
  driver.turn(0, 1.0);
  EXPECT_EQ(driver.machine.crashes(), 0U) << "not as far as there";
  driver.turn(0, 2.5);
  EXPECT_EQ(driver.machine.crashes(), 1U);
}

TEST(Solids, AnAxisStopsBesideItsAngleByItsNoise) {
  Config config = furnished();
  config.rotary.noise_rad = 1e-3;
  std::vector<double> off;
  for (std::uint64_t seed = 1; seed <= 200; ++seed) {
    Machine machine{config, seed};
    machine.turnTo({.c_rad = 1.5707963267948966}, seconds(1));
    machine.moveTo({300, 100, 20}, 50, seconds(20));
    machine.moveTo({300, 88, 20}, 50, seconds(40));
    ASSERT_EQ(machine.stylus().contactCount(), 1U);
    const Contact contact = *machine.stylus().contact(0);
    const Vector3 centre = contact.point - 9.0 * contact.normal;
    // Where the ball is, the axis leans by (0.12, -0.18) mm; from there the arm of (29.88, 0.18) mm has been turned.
    off.push_back((300 + 0.12 - 0.18 - centre[0]) / 30);
  }
  const auto [mean, sd] = testing::momentsOf(off);
  EXPECT_NEAR(mean, 0, 3e-4);
  EXPECT_NEAR(sd, 1e-3, 2.5e-4);
}

// A quarter turn with errors, worked out by hand: sin = 1 and cos - 1 = -1.
TEST(Part, IsOffByTheErrorsOfItsAxisAndByNothingAtZero) {
  Config config = furnished();
  config.part_spindle.direction = {0, 0, 1};
  config.part_spindle.errors = {
      .cosine_mm = {0.01, 0, 0}, .sine_mm = {0, 0.02, 0}, .cosine_rad = {0, 0, 0}, .sine_rad = {1e-6, 0, 0}};
  const Machine machine{config};
  const Vector3 point = config.part_spindle.point_mm + Vector3{40, 0, 100};
  EXPECT_LT(norm(machine.partPoint(point, {}) - point), 1e-12);
  const Vector3 quarter = machine.partPoint(point, {.c_rad = M_PI / 2}) - config.part_spindle.point_mm;
  const Vector3 expected{-0.01, 40 + 0.02 - 100e-6, 100 + 40e-6};
  EXPECT_LT(norm(quarter - expected), 1e-9);
}

}  // namespace
}  // namespace probebox::world
