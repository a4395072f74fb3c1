#include "drivers/world/following.hpp"

#include <cmath>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "ball_on_rim.hpp"
#include "streams.hpp"

// A control outside leads the machine: what the sensors show of it, whenever it is told.
namespace probebox::world {
namespace {

using namespace std::chrono_literals;
using testing::fitLine;
using ::testing::HasSubstr;
using testing::pollAll;
using testing::quiet;
using testing::seconds;
using testing::Streams;
using testing::takeApart;

constexpr double kCycle_s = 1e-3;

// Delivers cycles of a control as they come, and collects what the sensors show.
class Led {
 public:
  explicit Led(const Config& config) : world{config, 1} {
    lead.motor_mm = config.axes.home_mm;
    lead.tool = config.probe_spindle.tool;
  }

  std::optional<std::string> cycle() { return following.take(lead, now); }
  void stand(double time_s) {
    for (int k = 0; k < static_cast<int>(std::lround(time_s / kCycle_s)); ++k) {
      pass(1ms);
      ASSERT_EQ(cycle(), std::nullopt);
    }
  }
  void pass(Nanoseconds time) {
    now += time;
    world.advanceTo(following.known(now));
    pollAll(world, events);
  }
  void turnC(double to_rad, double speed_rad_s) {
    const double from_rad = lead.pose.c_rad;
    const int cycles = static_cast<int>(std::lround(std::abs(to_rad - from_rad) / speed_rad_s / kCycle_s));
    for (int k = 1; k <= cycles; ++k) {
      pass(1ms);
      lead.pose.c_rad = from_rad + k * (to_rad - from_rad) / cycles;
      ASSERT_EQ(cycle(), std::nullopt);
      touched.push_back(world.machine().touching());
    }
  }
  // Along an axis, told in bunches of so many cycles.
  void move(std::size_t axis, double way_mm, double speed_mm_s, int bunch) {
    const int cycles = static_cast<int>(std::lround(std::abs(way_mm) / speed_mm_s / kCycle_s));
    for (int k = 0; k < cycles; ++k) {
      if (k % bunch == 0) pass(bunch * 1ms);
      lead.motor_mm[axis] += way_mm / cycles;
      ASSERT_EQ(cycle(), std::nullopt);
      touched.push_back(world.machine().touching());
    }
  }

  World world;
  Following following{{}, world};
  Lead lead;
  MonoTime now{};
  std::vector<Event> events;
  std::vector<bool> touched;  // by cycle of a move
};

Config aboveTheSphere() {
  Config config = quiet();
  config.axes.home_mm = config.sphere.centre_mm + Vector3{0, 0, 20};  // 4.5 mm off its surface
  config.delays = {};
  config.encoders.power_up_mm = {};
  config.encoders.rate_hz = 487;  // at all phases of the cycles
  return config;
}

TEST(Following, GivesAMotionTheSpeedOfItsControlHoweverItsCyclesCome) {
  for (const int bunch : {1, 17, 120}) {
    SCOPED_TRACE(bunch);
    Led led{aboveTheSphere()};
    led.stand(0.3);
    led.move(0, 5, 10, bunch);
    led.stand(0.5);
    std::vector<double> times, positions;
    const auto streams = takeApart(led.events);
    for (const auto& count : streams.counts[0]) {
      const double at_mm = static_cast<double>(count.counts) * 1e-6;
      if (at_mm < 10.5 || at_mm > 14.5) continue;
      times.push_back(toSeconds(count.at - MonoTime{}));
      positions.push_back(at_mm);
    }
    ASSERT_GT(times.size(), 180U);
    const auto line = fitLine(times, positions);
    EXPECT_NEAR(line.slope, 10, 1e-3);
    for (std::size_t i = 0; i < times.size(); ++i)
      EXPECT_NEAR(positions[i], line.intercept + line.slope * times[i], 1e-5) << times[i];
  }
}

TEST(Following, TellsAContactInItsOwnCycleAndTheProbeShowsIt) {
  Led led{aboveTheSphere()};
  led.stand(0.3);
  led.move(2, -5, 10, 7);
  // 4.5 mm at 0.01 mm a cycle.
  ASSERT_EQ(led.touched.size(), 500U);
  EXPECT_FALSE(led.touched[448]);
  EXPECT_TRUE(led.touched[451]);
  led.stand(0.5);
  const auto streams = takeApart(led.events);
  const auto& deepest = streams.deflections.back().channels_nm;
  const Config config = aboveTheSphere();
  const Vector3 mm = config.probe.gain * Vector3{1e-6 * deepest[0], 1e-6 * deepest[1], 1e-6 * deepest[2]};
  EXPECT_NEAR(mm[2], 0.5, 1e-5);
  led.touched.clear();
  led.move(2, 5, 10, 7);
  EXPECT_TRUE(led.touched[48]);
  EXPECT_FALSE(led.touched[51]);
  EXPECT_EQ(led.world.machine().crashes(), 0U);
}

TEST(Following, LetsTheWorldWaitForAControlThatIsLateAndGoOnWithoutOneThatIsSilent) {
  Led led{aboveTheSphere()};
  led.stand(0.3);
  led.move(0, 1, 10, 1);
  const MonoTime last = led.now;
  led.pass(500ms);
  EXPECT_LT(led.world.now(), last + 200ms) << "what the machine does next is not known yet";
  led.pass(600ms);
  EXPECT_EQ(led.world.now(), led.now);
  // Its time goes on where the machine's is.
  led.move(0, 1, 10, 1);
  led.stand(0.5);
  EXPECT_NEAR(led.world.machine().positionAt(led.world.now())[0], aboveTheSphere().axes.home_mm[0] + 2, 1e-9);
}

TEST(Following, IsNoLaterAfterAPauseThanBefore) {
  Led led{aboveTheSphere()};
  led.stand(0.3);
  for (int k = 0; k < 2000; ++k) {  // two seconds at once, as of a control that was suspended
    led.lead.motor_mm[0] += k % 2 == 0 ? 1e-3 : -1e-3;
    ASSERT_EQ(led.cycle(), std::nullopt);
  }
  led.stand(2.5);
  led.lead.motor_mm[0] += 0.1;
  led.stand(0.16);
  EXPECT_NEAR(led.world.machine().positionAt(led.world.now())[0], led.lead.motor_mm[0], 1e-9);
}

TEST(Following, RefusesAJumpAndAToolThatIsNotThere) {
  Led led{aboveTheSphere()};
  led.lead.motor_mm = {0, 0, 0};
  EXPECT_THAT(led.cycle().value_or(""), ::testing::AllOf(HasSubstr("0.000 0.000"), HasSubstr("10.000 -20.000")));
  led.lead.motor_mm = aboveTheSphere().axes.home_mm;
  led.lead.tool = 77;
  EXPECT_THAT(led.cycle().value_or(""), HasSubstr("tool 77"));
  EXPECT_EQ(led.world.machine().commandedPosition(), aboveTheSphere().axes.home_mm);
}

TEST(Following, LeadsTheMotorsAndWarmScrewsPutTheNutsElsewhere) {
  Config config = aboveTheSphere();
  config.screws[0] = board::WorldScrew{.cold_um = 80, .warm_um = 80, .time_constant_s = 600};
  auto& described = config.machine.screws[0].emplace();
  described.length_mm = 800, described.offset_mm = 100, described.pitch_mm = 10;
  const double lever = (config.axes.home_mm[0] + described.offset_mm) / described.length_mm;
  Led led{config};
  led.stand(0.5);
  EXPECT_NEAR(led.world.machine().positionAt(led.world.now())[0] - config.axes.home_mm[0], 0.08 * lever, 1e-5);
  const auto streams = takeApart(led.events);
  EXPECT_NEAR(static_cast<double>(streams.counts[0].back().counts) * 1e-6, config.axes.home_mm[0], 2e-5);
}

TEST(Following, TurnsTheProbeAndCountsATurnInContactAsACollision) {
  Config config = aboveTheSphere();
  config.probe_spindle.stylus_offset_mm = {0.2, 0};
  Led led{config};
  led.stand(0.3);
  led.lead.pose.a_rad = std::acos(-1.0);
  led.stand(0.3);
  EXPECT_NEAR(led.world.machine().tipIn(led.world.machine().commandedPose(), 1)[0], -0.2, 1e-9);
  led.move(2, -5, 10, 1);
  EXPECT_EQ(led.world.machine().crashes(), 0U);
  led.lead.pose.a_rad = 0;
  led.stand(0.3);
  EXPECT_EQ(led.world.machine().crashes(), 1U);
}

// The stylus, whose ball has 3 mm, stands beside the ball at the same height.
Config besideABall() {
  Config config = testing::withABall();
  config.delays = {};
  config.probe.bounce_mm = 0;
  config.axes.home_mm = {315, 110, -20};
  return config;
}

// Angle of C at which the ball is 9 mm from the stylus, on its left.
double contact_rad() {
  const double away = std::hypot(15, 60);
  const double between = std::acos((away * away + 60 * 60 - 81) / (2 * away * 60));
  return -(std::atan2(15, 60) - between);
}

TEST(Following, TakesTheStylusAlongWhereCTurnsABallIntoIt) {
  for (const double noise_rad : {0.0, 1e-5}) {
    Config config = besideABall();
    config.rotary.noise_rad = noise_rad;
    Led led{config};
    led.stand(0.3);
    const double at_rad = contact_rad(), beyond_rad = 0.005;
    led.turnC(at_rad - beyond_rad, 0.02);
    // 20 urad a cycle.
    const auto meets = static_cast<std::size_t>(-at_rad / 2e-5);
    ASSERT_GT(led.touched.size(), meets + 3);
    EXPECT_FALSE(led.touched[meets - 3]);
    EXPECT_TRUE(led.touched[meets + 3]);
    led.stand(0.5);
    const auto streams = takeApart(led.events);
    const auto& shown = streams.deflections.back().channels_nm;
    const Vector3 mm = config.probe.gain * Vector3{1e-6 * shown[0], 1e-6 * shown[1], 1e-6 * shown[2]};
    EXPECT_NEAR(norm(mm), beyond_rad * std::hypot(15, 60), 2e-5 + 300 * noise_rad) << "as far as its arm has turned";
    EXPECT_GT(mm[0], 0.25);
    led.touched.clear();
    led.turnC(0, 0.02);
    EXPECT_TRUE(led.touched[247]);
    EXPECT_FALSE(led.touched[253]);
    EXPECT_FALSE(led.touched.back());
    led.stand(0.5);
    EXPECT_EQ(led.world.machine().stylus().contactCount(), 1U);
    EXPECT_EQ(led.world.machine().crashes(), 0U);
    EXPECT_LT(norm(led.world.machine().stylusDisplacementAt(led.world.now())), 1e-6);
  }
}

TEST(Following, LetsTheStylusGoWhereTheAxesLeaveTheBall) {
  Led led{besideABall()};
  led.stand(0.3);
  led.turnC(contact_rad() - 0.005, 0.02);
  ASSERT_TRUE(led.touched.back());
  led.lead.motor_mm[0] += 5e-5;  // a warm screw
  led.stand(0.1);
  EXPECT_TRUE(led.world.machine().touching());
  led.move(0, 2, 10, 1);
  EXPECT_FALSE(led.touched.back());
  led.stand(0.5);
  EXPECT_LT(norm(led.world.machine().stylusDisplacementAt(led.world.now())), 1e-6);
  EXPECT_EQ(led.world.machine().crashes(), 0U);
}

TEST(Following, ShowsTheAngleOfCAllAlongATurn) {
  Led led{besideABall()};
  led.stand(0.3);
  led.turnC(0.1, 0.05);
  const MonoTime known = led.following.known(led.now);
  const auto& machine = led.world.machine();
  const double at_rad = machine.partAngleAt(known - 100ms);
  EXPECT_GT(at_rad, 0.05);
  EXPECT_NEAR(machine.partAngleAt(known - 200ms), at_rad - 0.1 * 0.05, 1e-9);
  EXPECT_NEAR(machine.partAngleAt(known - 100ms, 0.0503), at_rad - 0.0503 * 0.05, 1e-9);
}

TEST(Following, CountsATurnThatRunsIntoTheStylusAsACollision) {
  Led led{besideABall()};
  led.stand(0.3);
  led.turnC(contact_rad() - 0.005, 2);  // 120 mm/s
  EXPECT_GT(led.world.machine().crashes(), 0U);
}

}  // namespace
}  // namespace probebox::world
