#include "firmware/metrology/touch/switched_touch.hpp"

#include <algorithm>
#include <cmath>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <random>
#include <string>

#include "host-tests/metrology/moments.hpp"

namespace probebox::metrology {
namespace {

using Eigen::Vector3d;
using testing::HasSubstr;

constexpr double kDwell_s = 0.1;

// A machine that drives onto a surface and back at constant speed, seen late, and a switch that is late as well.
struct Motion {
  Vector3d surface{12.0, -7.0, -150.0};
  Vector3d normal{1, 0, 0};
  double in_mm_s{5}, out_mm_s{5};
  double overtravel_mm{0.5}, clearance_mm{0.6};
  double tau_machine_s{0.005}, switch_late_s{0.0004};
  double noise_mm{0};
  double rate_hz{1000};
  double bend_mm_s2{0};  // acceleration on the way in

  double contact_s() const { return 0.02 + clearance_mm / in_mm_s; }
  double release_s() const { return contact_s() + overtravel_mm / in_mm_s + kDwell_s + overtravel_mm / out_mm_s; }
  // Outwards of the surface.
  double outside_mm(double t) const {
    const double turn_s = contact_s() + overtravel_mm / in_mm_s;
    if (t < 0.02) return clearance_mm;
    if (t < turn_s) {
      const double since = t - contact_s();
      return -in_mm_s * since + bend_mm_s2 / 2 * since * since;
    }
    if (t < turn_s + kDwell_s) return -overtravel_mm;
    return std::min(-overtravel_mm + out_mm_s * (t - turn_s - kDwell_s), 2.0);
  }
};

Dataset datasetOf(const std::vector<Motion>& motions, std::uint64_t seed = 1) {
  std::mt19937_64 random{seed};
  auto machine = Table::withColumns("machine", kMachineColumns);
  auto touches = Table::withColumns("touches", kTouchesColumns);
  auto edges = Table::withColumns("edges", kEdgesColumns);
  for (std::size_t i = 0; i < motions.size(); ++i) {
    const auto& motion = motions[i];
    const auto number = static_cast<double>(i);
    const double phase = std::uniform_real_distribution<double>{0, 1}(random);
    for (double count = phase; count / motion.rate_hz < motion.release_s() + 0.4; ++count) {
      const double t = count / motion.rate_hz;
      Vector3d at = motion.surface + motion.outside_mm(t - motion.tau_machine_s) * motion.normal;
      for (double& value : at) value += motion.noise_mm * std::normal_distribution<double>{}(random);
      machine.append({number, t, at.x(), at.y(), at.z()});
    }
    const auto& n = motion.normal;
    touches.append({number, n.x(), n.y(), n.z(), n.x(), n.y(), n.z(), 5});
    edges.append({number, motion.contact_s() + motion.switch_late_s, motion.release_s() + motion.switch_late_s});
  }
  return {.method = "tool-setter", .config = {}, .tables = {machine, touches, edges}};
}

std::string refusalOf(const Motion& motion) {
  const auto found = switchedTouches(datasetOf({motion}), {0.005, 0.005, 0.005});
  EXPECT_FALSE(found);
  return found ? "" : found.error().name + ": " + found.error().reason;
}

TEST(SwitchedTouch, FindsTheSurfaceWhateverTheDelaysAre) {
  const std::vector<Motion> motions{Motion{}, Motion{.normal = {0, -1, 0}}, Motion{.normal = {0, 0, 1}},
                                    Motion{.tau_machine_s = 0.003, .switch_late_s = 0.002}};
  for (const double tau : {0.0, 0.005}) {
    const auto found = switchedTouches(datasetOf(motions), {tau, tau, tau});
    ASSERT_TRUE(found) << found.error().reason;
    ASSERT_EQ(found->size(), motions.size());
    for (std::size_t i = 0; i < motions.size(); ++i) {
      EXPECT_LT(((*found)[i].at_mm - motions[i].surface).norm(), 1e-9) << i;
      EXPECT_EQ((*found)[i].normal, motions[i].normal);
      // tau_machine - switch_late is what the delay in force ought to be.
      EXPECT_NEAR((*found)[i].late_s, tau - (motions[i].tau_machine_s - motions[i].switch_late_s), 1e-9);
    }
  }
}

// With the right delay each edge alone says where the surface is, also at speeds that are not quite the same.
TEST(SwitchedTouch, TakesTheDelayOutAtTheSpeedOfEachWay) {
  const auto found = switchedTouches(datasetOf({Motion{.in_mm_s = 4.6, .out_mm_s = 5.5}}), {0.0046, 0.0046, 0.0046});
  ASSERT_TRUE(found) << found.error().reason;
  EXPECT_LT((found->front().at_mm - Motion{}.surface).norm(), 1e-9);
  EXPECT_NEAR(found->front().late_s, 0, 1e-9);
}

TEST(SwitchedTouch, HasTheNoiseOfTwoLines) {
  double squares = 0;
  constexpr int kRuns = 400;
  for (int run = 0; run < kRuns; ++run) {
    const auto found =
        switchedTouches(datasetOf({Motion{.noise_mm = 1e-3}}, static_cast<std::uint64_t>(run) + 1), {0, 0, 0});
    ASSERT_TRUE(found) << found.error().reason;
    const double off = found->front().at_mm.x() - Motion{}.surface.x();
    squares += off * off;
  }
  // Two windows of 80 positions, each the mean of its line.
  const double expected = 1e-3 / std::sqrt(2 * 80.0);
  EXPECT_NEAR(std::sqrt(squares / kRuns), expected, 0.15 * expected);
}

// The edges are where they are in their windows: off the middle, a delay taken out of one makes its line less certain.
TEST(SwitchedTouch, StatesTheUncertaintyOfItsPlaceAtUnequalSpeeds) {
  Moments errors;
  for (std::uint64_t run = 1; run <= 600; ++run) {
    const Motion motion{.in_mm_s = 4.2, .out_mm_s = 5.8, .tau_machine_s = 0.004, .noise_mm = 1e-3};
    const auto found = switchedTouches(datasetOf({motion}, run), {0.004, 0.004, 0.004});
    ASSERT_TRUE(found) << found.error().reason;
    errors.add(found->front().at_mm.x() - motion.surface.x(), found->front().sd_mm);
  }
  expectHonest(errors);
}

TEST(SwitchedTouch, RefusesByTheNameOfTheTouchWhatIsNoTouchAtConstantSpeed) {
  EXPECT_THAT(refusalOf({.bend_mm_s2 = 6}),
              testing::AllOf(HasSubstr("speed-not-constant: "), HasSubstr("touch 0"), HasSubstr("way in")));
  EXPECT_THAT(refusalOf({.overtravel_mm = 0.1}), HasSubstr("speed-"));
  EXPECT_THAT(refusalOf({.in_mm_s = 3.9, .out_mm_s = 3.9}), HasSubstr("speed-differs"));
  EXPECT_THAT(refusalOf({.normal = {0, 1, 0}, .switch_late_s = -1}), HasSubstr("too-few-samples"));
  EXPECT_THAT(refusalOf({.rate_hz = 100}), HasSubstr("more often"));
}

// One sample in eighty, in any coordinate: also across the motion, where the speed does not show it.
TEST(SwitchedTouch, RefusesAPositionThatIsOffTheLineOfTheOthers) {
  for (const char* const channel : {"x_mm", "y_mm", "z_mm"}) {
    for (const double off_mm : {-0.05, 1.0}) {
      auto dataset = datasetOf({Motion{.noise_mm = 1e-4}});
      auto& machine = dataset.tables.front();
      auto& values = std::ranges::find(machine.columns, channel, &Column::name)->values;
      const auto& times = *machine.column("t_s");
      const auto after = std::ranges::lower_bound(times, Motion{}.contact_s() + 0.01);
      values[static_cast<std::size_t>(after - times.begin())] += off_mm;
      const auto found = switchedTouches(dataset, {0, 0, 0});
      ASSERT_FALSE(found) << channel << " " << off_mm;
      EXPECT_THAT(found.error().reason, testing::AllOf(HasSubstr("touch 0"), HasSubstr("way in")));
      if (channel != std::string{"x_mm"}) {
        EXPECT_EQ(found.error().name, "off-the-line");
      }
    }
  }
}

TEST(SwitchedTouch, NamesTheTouchWithoutPositionsOrEdges) {
  auto dataset = datasetOf({Motion{}, Motion{}});
  auto& edges = dataset.tables[2];
  for (auto& column : edges.columns) column.values.pop_back();
  const auto found = switchedTouches(dataset, {0, 0, 0});
  ASSERT_FALSE(found);
  EXPECT_EQ(found.error().name, "missing-touch");
  EXPECT_THAT(found.error().reason, HasSubstr("touch 1"));
}

}  // namespace
}  // namespace probebox::metrology
