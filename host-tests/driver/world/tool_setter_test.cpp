#include <algorithm>
#include <cmath>
#include <gtest/gtest.h>
#include <optional>

#include "streams.hpp"

// The device that tools are set on: what it says when a tool or the stylus touches it, and tools that are changed.
namespace probebox::world {
namespace {

using testing::pollAll;
using testing::quiet;
using testing::seconds;

Config withSetter() {
  Config config = quiet();
  config.trigger_line = true;
  config.sphere.stylus_ball_radius_mm = 3;
  config.probe_spindle.stylus_length_mm = 150;
  config.tool_setter = board::WorldToolSetter{
      .centre_mm = {100, 50, 20}, .half_width_mm = {8, 7, 6}, .late_s = 0.0004, .repeatability_um = 0};
  config.further_tools = {{.number = 4, .offset_mm = {0.5, -0.25}, .length_mm = 120, .radius_mm = 5}};
  return config;
}

// Drives along a line, 30 mm and back, and keeps the edges of the trigger lines.
class SetterWorld : public ::testing::Test {
 protected:
  void start(const Config& config) { world_.emplace(config, 1); }
  void goTo(const Vector3& target) { drive(target, 100); }
  void drive(const Vector3& target, double speed_mm_s) {
    ASSERT_TRUE(world_->machine().moveTo(target, speed_mm_s, seconds(now_s_)));
    wait(norm(target - from_) / speed_mm_s + 1);
    from_ = target;
  }
  void wait(double s) {
    now_s_ += s;
    world_->advanceTo(seconds(now_s_));
    pollAll(*world_, events_);
  }
  std::vector<Edge> edgesOf(std::uint8_t line) {
    auto edges = testing::takeApart(events_).edges;
    std::erase_if(edges, [&](const Edge& edge) { return edge.role != LineRole::trigger || edge.line != line; });
    return edges;
  }
  // Machine position at an edge, what the device is late by taken out.
  Vector3 placeAt(const Edge& edge) const { return world_->machine().positionAt(edge.at, 0.0004); }

  std::optional<World> world_;
  std::vector<Event> events_;
  double now_s_{1};
  Vector3 from_{testing::usual().axes.home_mm};
};

TEST_F(SetterWorld, IsClosedFromContactToReleaseAndTheProbeFeelsIt) {
  start(withSetter());
  goTo({130, 50, 110});
  goTo({130, 50, 20});
  drive({110.5, 50, 20}, 5);
  drive({130, 50, 20}, 5);
  const auto edges = edgesOf(1);
  ASSERT_EQ(edges.size(), 2U);
  EXPECT_EQ(edges[0].level, Level::active);
  EXPECT_EQ(edges[1].level, Level::inactive);
  EXPECT_EQ(edges[1].line_sequence, 2U);
  for (const auto& edge : edges) EXPECT_NEAR(placeAt(edge)[0], 100 + 8 + 3, 1e-4) << "half width and stylus ball";
  EXPECT_EQ(edgesOf(0).size(), 2U) << "the probe's own trigger";
}

TEST_F(SetterWorld, IsTouchedByAToolWithItsRadiusAtTheSidesAndItsTipOnTop) {
  start(withSetter());
  ASSERT_TRUE(world_->machine().takeTool(4, seconds(now_s_)));
  EXPECT_FALSE(world_->machine().moveTo({130, 50, 110}, 100, seconds(now_s_ + 1))) << "the change takes its time";
  wait(3.1);
  goTo({130, 50, 110});
  goTo({130, 50, -10});  // the tip hangs 30 mm above where the ball does: at the middle of the faces
  drive({112, 50, -10}, 5);
  drive({130, 50, -10}, 5);
  goTo({130, 50, 110});
  goTo({100, 50, 110});
  goTo({100, 50, 10});
  drive({100, 50, -4.5}, 5);
  drive({100, 50, 10}, 5);
  const auto edges = edgesOf(1);
  ASSERT_EQ(edges.size(), 4U);
  EXPECT_NEAR(placeAt(edges[0])[0], 100 + 8 + 5 - 0.5, 1e-4);
  EXPECT_NEAR(placeAt(edges[1])[0], 100 + 8 + 5 - 0.5, 1e-4);
  EXPECT_NEAR(placeAt(edges[2])[2], 20 + 6 - (150 - 120), 1e-4);
  EXPECT_TRUE(edgesOf(0).empty()) << "no probe is in the spindle";
  EXPECT_EQ(world_->truth().ledger.setter_edges, 4U);
  const auto deflections = testing::takeApart(events_).deflections;
  EXPECT_TRUE(std::ranges::all_of(deflections, [](const Deflection& d) { return d.channels_nm[0] == 0; }));
}

TEST_F(SetterWorld, KeepsThePartWhereItIsWhileAToolIsChanged) {
  start(withSetter());
  ASSERT_TRUE(world_->machine().turnTo({.c_rad = 1}, seconds(now_s_)));
  wait(3);
  ASSERT_TRUE(world_->machine().takeTool(4, seconds(now_s_)));
  for (const double later_s : {0.0, 0.5, 1.5, 5.0})
    EXPECT_EQ(world_->machine().partAngleAt(seconds(now_s_ + later_s)), 1) << later_s;
}

TEST_F(SetterWorld, SaysNothingOfOtherFeaturesOrWhereThereIsNone) {
  start(withSetter());
  const auto sphere = withSetter().sphere;
  goTo(sphere.centre_mm + Vector3{0, 0, 30});
  drive(sphere.centre_mm + Vector3{0, 0, 15.2}, 5);
  drive(sphere.centre_mm + Vector3{0, 0, 30}, 5);
  EXPECT_EQ(edgesOf(0).size(), 2U);
  EXPECT_TRUE(edgesOf(1).empty());
  EXPECT_FALSE(world_->machine().takeTool(9, seconds(now_s_))) << "there is no such tool";
}

TEST_F(SetterWorld, SwitchesAsWellAsItIsSaidTo) {
  auto config = withSetter();
  config.tool_setter->repeatability_um = 2;
  start(config);
  goTo({130, 50, 110});
  goTo({130, 50, 20});
  double squares = 0;
  constexpr int kTouches = 50;
  for (int i = 0; i < kTouches; ++i) {
    drive({110.5, 50, 20}, 5), drive({111.5, 50, 20}, 5);
    const auto edges = edgesOf(1);
    events_.clear();
    ASSERT_EQ(edges.size(), 2U);
    for (const auto& edge : edges) {
      const double off_mm = placeAt(edge)[0] - 111;
      squares += off_mm * off_mm / (2 * kTouches);
    }
  }
  EXPECT_NEAR(std::sqrt(squares), 2e-3, 5e-4);
}

}  // namespace
}  // namespace probebox::world
