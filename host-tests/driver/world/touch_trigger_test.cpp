#include <cmath>
#include <gtest/gtest.h>
#include <vector>

#include "streams.hpp"

// The switch of a touch-trigger probe: pre-travel by direction, hysteresis, lateness and chatter.
namespace probebox::world {
namespace {

using testing::quiet;
using testing::run;
using testing::seconds;

constexpr double kSpeed_mm_s = 10;

Config triggering() {
  Config config = quiet();
  config.trigger_line = true;
  config.touch_trigger = board::WorldTouchTrigger{.pre_travel_mm = 0.010,
                                                  .lobe_mm = 0.004,
                                                  .axial_mm = 0.002,
                                                  .hysteresis_mm = 0.001,
                                                  .repeatability_um = 0,
                                                  .late_s = 0.0005,
                                                  .chatter_s = 0.0008};
  return config;
}

// Edges of one touch of the sphere from this side, and the world that they come from.
struct Touched {
  std::vector<Edge> edges;
  std::size_t deflections{};
  Contact contact;
};

Touched touch(const Config& config, const Vector3& outward, std::uint64_t seed = 1) {
  World world{config, seed};
  Machine& machine = world.machine();
  const Vector3 surface =
      config.sphere.centre_mm + (config.sphere.radius_mm + config.sphere.stylus_ball_radius_mm) * outward;
  EXPECT_TRUE(machine.moveTo(surface + 2.0 * outward, 200, seconds(1)));
  EXPECT_TRUE(machine.moveTo(surface - 0.5 * outward, kSpeed_mm_s, seconds(5)));
  const auto streams = run(world, 6);
  EXPECT_TRUE(machine.moveTo(surface + 2.0 * outward, kSpeed_mm_s, seconds(6)));
  const auto later = run(world, 8);
  Touched touched{.edges = {}, .deflections = streams.deflections.size(), .contact = *machine.stylus().contact(0)};
  for (const auto* part : {&streams, &later}) {
    for (const auto& edge : part->edges)
      if (edge.role == LineRole::trigger) touched.edges.push_back(edge);
  }
  return touched;
}

double late_s(const Edge& edge, const Instant& than) {
  return than.elapsed(edge.at, 0);
}

TEST(TouchTrigger, OpensBehindContactByThePreTravelOfTheDirection) {
  const auto config = triggering();
  const auto& trigger = *config.touch_trigger;
  const struct {
    Vector3 outward;
    double pre_travel_mm;
  } directions[]{{{1, 0, 0}, 0.014}, {{-1, 0, 0}, 0.006}, {{0, 1, 0}, 0.010}, {{0, 0, 1}, 0.002}};
  for (const auto& [outward, pre_travel_mm] : directions) {
    const auto touched = touch(config, outward);
    ASSERT_EQ(touched.edges.size(), 2U);
    EXPECT_EQ(touched.deflections, 0U) << "there are no channels";
    EXPECT_EQ(touched.edges[0].level, Level::active);
    EXPECT_EQ(touched.edges[1].level, Level::inactive);
    EXPECT_EQ(touched.edges[0].line, 0);
    EXPECT_EQ(touched.edges[1].line_sequence, 2U);
    EXPECT_NEAR(late_s(touched.edges[0], touched.contact.begin), trigger.late_s + pre_travel_mm / kSpeed_mm_s, 2e-8);
    EXPECT_NEAR(late_s(touched.edges[1], *touched.contact.end),
                trigger.late_s - (pre_travel_mm - trigger.hysteresis_mm) / kSpeed_mm_s, 2e-8);
  }
}

TEST(TouchTrigger, MayChatterAndEndsAtTheRightLevel) {
  auto config = triggering();
  config.touch_trigger->chatter_probability = 1;
  const auto touched = touch(config, {1, 0, 0});
  ASSERT_EQ(touched.edges.size(), 10U);
  for (std::size_t i = 0; i < touched.edges.size(); ++i) {
    EXPECT_EQ(touched.edges[i].level, i % 2 == 0 ? Level::active : Level::inactive);
    EXPECT_EQ(touched.edges[i].line_sequence, i + 1);
    EXPECT_GE(touched.edges[i].at, touched.edges[i > 0 ? i - 1 : 0].at);
  }
  EXPECT_LT(toSeconds(touched.edges[4].at - touched.edges[0].at), config.touch_trigger->chatter_s);
  EXPECT_GT(toSeconds(touched.edges[5].at - touched.edges[4].at), 0.1) << "the stylus is pressed in between";
}

TEST(TouchTrigger, RepeatsWithItsScatter) {
  auto config = triggering();
  config.touch_trigger->repeatability_um = 1;
  double squares = 0;
  constexpr int kTouches = 200;
  for (int i = 0; i < kTouches; ++i) {
    const auto touched = touch(config, {0, 1, 0}, static_cast<std::uint64_t>(i + 1));
    const double off_mm =
        kSpeed_mm_s * (late_s(touched.edges.at(0), touched.contact.begin) - config.touch_trigger->late_s) - 0.010;
    squares += off_mm * off_mm;
  }
  const double sd_um = 1e3 * std::sqrt(squares / kTouches);
  EXPECT_GT(sd_um, 0.85);
  EXPECT_LT(sd_um, 1.15);
}

}  // namespace
}  // namespace probebox::world
