#include <array>
#include <cmath>
#include <gtest/gtest.h>

#include "host-tests/emulation/scenario.hpp"
#include "protocol/units/angle.hpp"

// Step 2 of a large lathe (CN101976057, metrology B25): the stylus stands at equal heights on either side of the line,
// and C turns until its ball touches. The stamps of the trigger say where C was.
namespace probebox::scenario {
namespace {

using namespace std::chrono_literals;
using world::Vector3;
using world::operator+;

constexpr double kRim_mm = 60;
constexpr double kBeside_mm = 15;
constexpr double kSpeed_rad_s = 0.05;
// The ball of the rim is 0.9 degrees away from the line along +Y when C stands at 0.
constexpr double kOff_rad = 0.9 * kDegree;

world::Config turningRimWorld() {
  auto config = usualWorld();
  config.part_spindle.direction = {0, 0, 1};
  config.part_spindle.balls_mm = {{kRim_mm * std::sin(kOff_rad), kRim_mm * std::cos(kOff_rad), 20}};
  config.rotary.noise_rad = config.swivel_head->noise_rad = 0;
  config.probe_spindle.direction = {0, 0, 1};
  config.probe_spindle.stylus_offset_mm = {0, 0};
  config.axes.home_mm = config.part_spindle.point_mm + Vector3{0, kRim_mm, 200};
  return config;
}

// A machine that this test commands itself, and a box.
class TurnedUntilContact : public testing::TestWithParam<std::uint64_t> {
 protected:
  const world::Config config{turningRimWorld()};
  Recorder recorder;
  box::Box box{usualBox(config), recorder};
  world::World world{config, GetParam()};
  MonoTime now{config.start}, said{config.start};

  void run(Nanoseconds duration) {
    recorder.keeps_bytes = false;
    for (const MonoTime end = now + duration; now < end;) {
      world.advanceTo(now += 1ms);
      std::array<Event, 64> batch;
      while (const std::size_t count = world.poll(batch))
        for (std::size_t i = 0; i < count; ++i) box.push(batch.at(i));
      if (now - said < 10ms) continue;
      box.push(TimeAdvanced{now});
      said = now;
    }
  }
  world::Machine& machine() { return world.machine(); }
  void standStill() {
    while (!machine().atRest(now)) run(10ms);
    run(100ms);
  }
  void moveTo(const Vector3& mm) {
    EXPECT_TRUE(machine().moveTo(mm, 100, now));
    standStill();
  }
  void turnTo(double c_rad) {
    EXPECT_TRUE(machine().turnTo({.c_rad = c_rad}, now));
    standStill();
  }

  // From `beside_mm` of the nominal line, at the height of the ball. C comes from outside.
  struct Found {
    published::TriggerStamp stamp;
    double struck_rad{};  // where C really was
  };
  Found touchBeside(double beside_mm) {
    const double from_rad = beside_mm > 0 ? -40 * kDegree : 40 * kDegree;
    const Vector3 at = config.part_spindle.point_mm + Vector3{beside_mm, kRim_mm, 20};
    turnTo(from_rad);
    moveTo({at[0], at[1], at[2] + 100});
    moveTo(at);
    recorder.triggers.clear();
    EXPECT_TRUE(machine().turnUntilContact(-from_rad, kSpeed_rad_s, now));
    standStill();
    EXPECT_EQ(recorder.triggers.size(), 1U);
    const Found found{recorder.triggers.empty() ? published::TriggerStamp{} : recorder.triggers.front().stamp,
                      machine().commandedPose().c_rad};
    turnTo(from_rad);
    moveTo({at[0], at[1], at[2] + 100});
    return found;
  }
};

TEST_P(TurnedUntilContact, HasTheAngleOfCAtItsStampAndTheBallOnTheLineInTheMiddle) {
  run(2s);
  double sum_rad = 0;
  for (const double beside_mm : {kBeside_mm, -kBeside_mm}) {
    const auto [stamp, struck_rad] = touchBeside(beside_mm);
    ASSERT_TRUE(stamp.has_angle[2]);
    EXPECT_FALSE(stamp.has_angle[0]) << "no encoder says how A stands";
    EXPECT_TRUE(stamp.has_position[1]);
    // The encoder is late, and the trigger a little.
    const double late_rad = kSpeed_rad_s * (world.truth().tau_s[2] - 1e-6 * config.clock.bias_us);
    EXPECT_GT(late_rad, 2e-4);
    EXPECT_NEAR(stamp.angle_rad[2], struck_rad + (beside_mm > 0 ? -late_rad : late_rad), 1e-6);
    sum_rad += stamp.angle_rad[2];
  }
  // Both are late alike, so their mean is not: turned by it, the ball stands on the line.
  EXPECT_NEAR(sum_rad / 2, kOff_rad, 1e-6);
  EXPECT_EQ(machine().crashes(), 0U);
}

INSTANTIATE_TEST_SUITE_P(Worlds, TurnedUntilContact, testing::Range<std::uint64_t>(1, 5));

}  // namespace
}  // namespace probebox::scenario
