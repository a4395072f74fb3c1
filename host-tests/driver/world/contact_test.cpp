#include <algorithm>
#include <cmath>
#include <gtest/gtest.h>

#include "drivers/world/random.hpp"
#include "streams.hpp"

namespace probebox::world {
namespace {

using testing::fitLine;
using testing::Line;
using testing::pollAll;
using testing::quiet;
using testing::run;
using testing::seconds;
using testing::Streams;

constexpr double kOvertravel = 0.5;
constexpr double kClearance = 0.6;

// One touch along a straight line through a point near the sphere's centre: in, a rest, and out again.
struct Touch {
  Vector3 outward{};
  double speed_mm_s{};
  Vector3 surface{};  // where the ball's centre is at contact, by bisection of this test
  double apex_s{};    // the body begins to retract
  double end_s{};
};

double distanceToSphere(const Config& config, const Vector3& position) {
  return norm(position - config.sphere.centre_mm) - config.sphere.radius_mm - config.sphere.stylus_ball_radius_mm;
}

Touch prepare(const Config& config, Random& random, double speed_mm_s) {
  Touch touch{.outward = unit({random.normal(), random.normal(), std::abs(random.normal())}),
              .speed_mm_s = speed_mm_s,
              .surface = {},
              .apex_s = 0,
              .end_s = 0};
  const Vector3 aim = config.sphere.centre_mm + 0.2 * Vector3{random.normal(), random.normal(), random.normal()};
  double inside = 0, outside = 40;
  for (int i = 0; i < 100; ++i) {
    const double middle = (inside + outside) / 2;
    (distanceToSphere(config, aim + middle * touch.outward) < 0 ? inside : outside) = middle;
  }
  touch.surface = aim + inside * touch.outward;
  return touch;
}

// Starts with the machine at the approach point.
Streams perform(World& world, Touch& touch, double start_s) {
  Machine& machine = world.machine();
  const double length = kOvertravel + kClearance;
  const double in_s = length / touch.speed_mm_s + 0.1;
  touch.apex_s = start_s + in_s + 0.1;
  touch.end_s = touch.apex_s + in_s + 0.1;
  run(world, start_s);
  EXPECT_TRUE(machine.moveTo(touch.surface - kOvertravel * touch.outward, touch.speed_mm_s, seconds(start_s)));
  auto streams = run(world, touch.apex_s);
  EXPECT_TRUE(machine.moveTo(touch.surface + kClearance * touch.outward, touch.speed_mm_s, seconds(touch.apex_s)));
  const auto retract = run(world, touch.end_s);
  streams.deflections.insert(streams.deflections.end(), retract.deflections.begin(), retract.deflections.end());
  for (std::size_t axis = 0; axis < 3; ++axis) streams.counts[axis] = retract.counts[axis];
  return streams;
}

double toSecondsOf(MonoTime at) {
  return 1e-9 * static_cast<double>(toNs(at));
}

Vector3 millimetres(const Deflection& sample) {
  return {1e-6 * sample.channels_nm[0], 1e-6 * sample.channels_nm[1], 1e-6 * sample.channels_nm[2]};
}

// Slopes of the channels, and the time of zero deflection of their projection on the slopes' direction. The retract
// from 60 to 10 % of the deflection at the apex.
struct Probed {
  Vector3 slope{};
  double zero_s{};
};

Probed probed(const Streams& streams, const Touch& touch) {
  std::vector<double> t;
  std::array<std::vector<double>, 3> channels;
  const auto at_apex =
      std::find_if(streams.deflections.begin(), streams.deflections.end(),
                   [&](const Deflection& sample) { return toSecondsOf(sample.at) > touch.apex_s - 0.02; });
  const double apex = norm(millimetres(*at_apex));
  for (auto sample = at_apex; sample != streams.deflections.end(); ++sample) {
    const Vector3 d = millimetres(*sample);
    if (toSecondsOf(sample->at) < touch.apex_s || norm(d) > 0.6 * apex || norm(d) < 0.1 * apex) continue;
    t.push_back(toSecondsOf(sample->at));
    for (std::size_t i = 0; i < 3; ++i) channels[i].push_back(d[i]);
  }
  Probed result;
  for (std::size_t i = 0; i < 3; ++i) result.slope[i] = fitLine(t, channels[i]).slope;
  std::vector<double> along(t.size());
  const Vector3 w = unit(result.slope);
  for (std::size_t k = 0; k < t.size(); ++k) along[k] = dot(w, {channels[0][k], channels[1][k], channels[2][k]});
  const Line line = fitLine(t, along);
  result.zero_s = -line.intercept / line.slope;
  return result;
}

// Where the machine's stream says it was at that time, by a line through its part of constant speed.
Vector3 machineAt(const Streams& streams, const Touch& touch, double at_s) {
  Vector3 position{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    std::vector<double> t, mm;
    for (const Count& count : streams.counts[axis]) {
      const double along_mm = touch.speed_mm_s * (toSecondsOf(count.at) - touch.apex_s - 0.0045);
      if (along_mm < 0.2 || along_mm > 0.9) continue;
      t.push_back(toSecondsOf(count.at));
      mm.push_back(1e-6 * static_cast<double>(count.counts));
    }
    const Line line = fitLine(t, mm);
    position[axis] = line.intercept + line.slope * at_s;
  }
  return position;
}

void goTo(World& world, const Touch& touch) {
  // Far out along the normal first: any way there is free when it starts above the sphere.
  world.machine().moveTo(touch.surface + 60.0 * touch.outward, 300, world.now());
  run(world, 1e-9 * static_cast<double>(toNs(world.now())) + 2);
  world.machine().moveTo(touch.surface + kClearance * touch.outward, 300, world.now());
  run(world, 1e-9 * static_cast<double>(toNs(world.now())) + 2);
}

TEST(Contact, IsDisplacedByTheDelayTimesTheVelocity) {
  // (A2): M = P - tau v, for each touch and without bias.
  Random random{1, 1};
  std::vector<double> error_um;
  for (std::uint64_t i = 0; i < 60; ++i) {
    Config config = testing::usual();
    config.axes.home_mm = {10, -20, 200};
    World world{config, i};
    Touch touch = prepare(config, random, random.uniform(5, 40));
    goTo(world, touch);
    const Streams streams = perform(world, touch, 5);
    const Vector3 measured = machineAt(streams, touch, probed(streams, touch).zero_s);
    const Vector3 expected = touch.surface - (0.0042 - 0.00035) * touch.speed_mm_s * touch.outward;
    error_um.push_back(1e3 * dot(measured - expected, touch.outward));
    EXPECT_LT(1e3 * norm(measured - expected), 3);
  }
  const auto [mean, sd] = testing::momentsOf(error_um);
  EXPECT_LT(std::abs(mean), 4 * sd / std::sqrt(60));
  EXPECT_LT(sd, 0.8) << "(A8) expects 0.2 to 0.5 um for these windows";
}

TEST(Contact, WithoutNoiseIsExact) {
  Random random{2, 1};
  for (std::uint64_t i = 0; i < 20; ++i) {
    Config config = quiet();
    config.axes.home_mm = {10, -20, 200};
    config.delays.tau_machine_s = {0.0042, 0.0042, 0.0042};
    World world{config, i};
    Touch touch = prepare(config, random, random.uniform(5, 40));
    goTo(world, touch);
    const Streams streams = perform(world, touch, 5);
    const Vector3 measured = machineAt(streams, touch, probed(streams, touch).zero_s);
    const Vector3 expected = touch.surface - 0.00385 * touch.speed_mm_s * touch.outward;
    EXPECT_LT(1e3 * norm(measured - expected), 0.01);
  }
}

TEST(Contact, ShowsTheGainMatrix) {
  // (A4): A ddot = -v in three independent directions leaves one matrix alone.
  const Config config = quiet();
  for (std::size_t axis = 0; axis < 3; ++axis) {
    World world{config, 1};
    Touch touch{};
    touch.outward[axis] = 1;
    touch.speed_mm_s = 25;
    touch.surface = config.sphere.centre_mm + 15.5 * touch.outward;
    goTo(world, touch);
    const Streams streams = perform(world, touch, 5);
    const Vector3 error = config.probe.gain * probed(streams, touch).slope + 25.0 * touch.outward;
    EXPECT_LT(norm(error), 2e-4) << "channels are whole nanometres";
  }
}

TEST(Contact, ReportsTheSlopesOfTheSpecifiedExample) {
  // Metrology A.2, worked: channels' slopes of a retract along +x at 25 mm/s.
  const Config config = quiet();
  World world{config, 1};
  Touch touch{.outward = {1, 0, 0}, .speed_mm_s = 25, .surface = {25.5, -20, 30}, .apex_s = 0, .end_s = 0};
  goTo(world, touch);
  const Vector3 slope = probed(perform(world, touch, 5), touch).slope;
  EXPECT_NEAR(slope[0], -25.506405, 2e-4);
  EXPECT_NEAR(slope[1], -0.297741, 2e-4);
  EXPECT_NEAR(slope[2], 0.149165, 2e-4);
}

TEST(Contact, KeepsTheBallOutsideTheSphereAndStuckWhileItTouches) {
  Random random{3, 1};
  for (std::uint64_t i = 0; i < 30; ++i) {
    Config config = quiet();
    config.probe.bounce_mm = i % 2 == 0 ? 0 : 0.05;
    config.axes.home_mm = {10, -20, 200};
    World world{config, i};
    Touch touch = prepare(config, random, random.uniform(5, 40));
    goTo(world, touch);
    perform(world, touch, 5);
    bool touched = false;
    for (double t = 5; t < touch.end_s; t += 0.0001) {
      const Vector3 body = world.machine().positionAt(seconds(t));
      const Vector3 ball = body + world.machine().stylusDisplacementAt(seconds(t));
      ASSERT_GE(distanceToSphere(config, ball), -1e-9);
      const bool pressed = dot(touch.surface - body, touch.outward) > 1e-6;
      touched |= pressed;
      if (pressed && config.probe.bounce_mm == 0) {
        ASSERT_LT(norm(ball - touch.surface), 1e-9);
      }
    }
    EXPECT_TRUE(touched);
    EXPECT_EQ(world.machine().stylus().contactCount(), 1U);
  }
}

TEST(Contact, BouncesOnApproachAndHasSettledBeforeTheRetract) {
  Config config = quiet();
  config.probe.bounce_mm = 0.02;
  World world{config, 1};
  Touch touch{.outward = {0, 0, 1}, .speed_mm_s = 20, .surface = {10, -20, 45.5}, .apex_s = 0, .end_s = 0};
  goTo(world, touch);
  perform(world, touch, 5);
  const auto ball = [&](double t) {
    return world.machine().positionAt(seconds(t)) + world.machine().stylusDisplacementAt(seconds(t));
  };
  const Contact contact = *world.machine().stylus().contact(0);
  const double touched_s = toSecondsOf(contact.begin.rounded());
  double highest_um = 0;
  for (double t = touched_s; t < touched_s + 0.01; t += 1e-5) {
    highest_um = std::max(highest_um, 1e3 * (ball(t)[2] - 45.5));
  }
  EXPECT_GT(highest_um, 5);
  EXPECT_LT(highest_um, 20);
  EXPECT_LT(1e3 * std::abs(ball(touch.apex_s)[2] - 45.5), 0.001);
}

TEST(Contact, ClipsAtTheEndOfTheRangeAndSaysSo) {
  Config config = quiet();
  config.probe.range_mm = 0.3;
  World world{config, 1};
  Touch touch{.outward = {1, 0, 0}, .speed_mm_s = 20, .surface = {25.5, -20, 30}, .apex_s = 0, .end_s = 0};
  goTo(world, touch);
  const Streams streams = perform(world, touch, 5);
  std::int32_t largest_nm = 0;
  std::size_t clipped = 0;
  for (const Deflection& sample : streams.deflections) {
    largest_nm = std::max(largest_nm, std::abs(sample.channels_nm[0]));
    clipped += sample.clipped ? 1 : 0;
    ASSERT_EQ(sample.clipped, std::abs(sample.channels_nm[0]) == 300'000);
  }
  EXPECT_EQ(largest_nm, 300'000);
  EXPECT_GT(clipped, 50U);
}

TEST(Contact, SwitchesTheTriggerLineWhenOneIsFitted) {
  Config config = quiet();
  config.trigger_line = true;
  World world{config, 1};
  Touch touch{.outward = {1, 0, 0}, .speed_mm_s = 20, .surface = {25.5, -20, 30}, .apex_s = 0, .end_s = 0};
  goTo(world, touch);
  std::vector<Event> events;
  world.machine().moveTo({25.0, -20, 30}, 20, seconds(5));
  world.advanceTo(seconds(6));
  pollAll(world, events);
  world.machine().moveTo({26.1, -20, 30}, 20, seconds(6));
  world.advanceTo(seconds(7));
  pollAll(world, events);
  std::vector<Edge> edges = testing::takeApart(events).edges;
  std::erase_if(edges, [](const Edge& edge) { return edge.role != LineRole::trigger; });
  ASSERT_EQ(edges.size(), 2U);
  EXPECT_EQ(edges[0].level, Level::active);
  EXPECT_EQ(edges[1].level, Level::inactive);
  EXPECT_EQ(edges[1].line_sequence, 2U);
  // 0.5 mm at 20 mm/s after the ramp (half of it is lost), late by the probe's delay.
  EXPECT_NEAR(toSecondsOf(edges[1].at), 6 + 0.025 + 0.0015 + 0.00035, 2e-5);
}

}  // namespace
}  // namespace probebox::world
