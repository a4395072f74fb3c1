#include "firmware/metrology/delay/delay_multi_speed.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <functional>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <string>

#include "host-tests/metrology/moments.hpp"
#include "host-tests/metrology/touch_simulation.hpp"
#include "host-tests/support/runs.hpp"
#include "host-tests/support/sanitized.hpp"

namespace probebox::metrology {
namespace {

using simulation::measure;
using simulation::moved;
using simulation::Scene;
using testing::AllOf;
using testing::Gt;
using testing::Lt;

double valueOf(const Result& result, std::string_view key) {
  return result.find(key)->value();
}
double sdOf(const Result& result, std::string_view key) {
  return *result.find(key)->standardDeviation();
}

struct TouchSetting {
  std::string name;
  std::function<void(Scene&)> change;
  // Against the reference precision, which knows of neither jitter nor lost samples. Two-sided: twice as good is a
  // mistake too.
  double least_efficiency{1.0};
  double greatest_efficiency{10.0};
};

const int kTouchTrials = support::kSanitized ? 20 : static_cast<int>(runs(100));

class DelayOverRandomTouches : public testing::TestWithParam<TouchSetting> {};

TEST_P(DelayOverRandomTouches, IsUnbiasedEfficientAndAsUncertainAsItSays) {
  // A mean of squares over so many trials is itself uncertain by this.
  const double uncertainty = std::sqrt(2.0 / kTouchTrials);
  std::mt19937_64 random{20260101};
  Moments tau;
  Moments diameter;
  simulation::Reference reference;
  for (int trial = 0; trial < kTouchTrials; ++trial) {
    Scene scene;
    GetParam().change(scene);
    scene = simulation::shuffled(scene, random);
    reference = simulation::referencePrecision(scene);
    const auto solved = solveDelayMultiSpeed(measure(scene, random));
    ASSERT_TRUE(solved.ok()) << solved.error().reason;
    tau.add(valueOf(solved.value(), "tau_s") - scene.tau(), sdOf(solved.value(), "tau_s"));
    diameter.add(valueOf(solved.value(), "effective_diameter_mm") - 2.0 * std::abs(scene.radius_mm),
                 sdOf(solved.value(), "effective_diameter_mm"));
  }
  const double efficiency = reference.tau_sd_s * reference.tau_sd_s / tau.variance();
  EXPECT_THAT(efficiency, AllOf(Gt(GetParam().least_efficiency * (1.0 - uncertainty)),
                                Lt(GetParam().greatest_efficiency * (1.0 + 2.0 * uncertainty))));
  expectHonest(tau);
  expectHonest(diameter);
  EXPECT_THAT(tau.bias(), AllOf(Gt(-4.0), Lt(4.0)));
  EXPECT_THAT(diameter.bias(), AllOf(Gt(-4.0), Lt(4.0)));
  EXPECT_GT(reference.diameter_sd_mm * reference.diameter_sd_mm / diameter.variance(),
            0.5 * GetParam().least_efficiency);
}

std::function<void(Scene&)> rates(double machine_hz, double probe_hz) {
  return [=](Scene& s) {
    s.machine_rate_hz = machine_hz;
    s.probe_rate_hz = probe_hz;
  };
}
std::function<void(Scene&)> shortDwell(double Scene::*changed, double value) {
  return [=](Scene& s) {
    s.*changed = value;
    s.dwell_s = 0.04;
  };
}

INSTANTIATE_TEST_SUITE_P(
    Settings, DelayOverRandomTouches,
    testing::Values(TouchSetting{"Usual", [](Scene&) {}, 2.0},
                    TouchSetting{"NoBounce", [](Scene& s) { s.bounce_mm = 0.0; }, 2.0},
                    TouchSetting{"TenTimesTheNoise",
                                 [](Scene& s) {
                                   s.machine_sigma_mm *= 10.0;
                                   s.probe_sigma_mm *= 10.0;
                                 },
                                 2.0},
                    TouchSetting{"SlowStreams", rates(333.0, 787.0), 1.4},
                    TouchSetting{"FastProbe", rates(1000.0, 4000.0), 1.2},
                    TouchSetting{"CoarseEncoder", [](Scene& s) { s.machine_resolution_mm = 0.001; }, 1.8},
                    TouchSetting{"Jitter", [](Scene& s) { s.stamp_jitter_s = 1e-5; }, 1.2},
                    TouchSetting{"LostSamples", [](Scene& s) { s.lost_share = 0.1; }, 1.5},
                    TouchSetting{"TwoSpeeds",
                                 [](Scene& s) {
                                   s.speeds_mm_s = {10.0, 30.0};
                                 },
                                 2.0},
                    TouchSetting{"ShallowTouches", shortDwell(&Scene::overtravel_mm, 0.3), 1.5},
                    TouchSetting{"GentleRamps", shortDwell(&Scene::acceleration_mm_s2, 5000.0), 1.8},
                    TouchSetting{"FromWithin", [](Scene& s) { s.radius_mm = -12.0; }, 2.0}),
    [](const auto& setting) { return setting.param.name; });

TEST(DelayMultiSpeed, IsExactWithoutNoise) {
  std::mt19937_64 random{5};
  for (int trial = 0; trial < 20; ++trial) {
    Scene scene = simulation::shuffled(simulation::withoutNoise({.bounce_mm = 0.0}), random);
    scene.lost_share = trial % 2 == 0 ? 0.0 : 0.1;
    const auto solved = solveDelayMultiSpeed(measure(scene, random));
    ASSERT_TRUE(solved.ok()) << solved.error().reason;
    EXPECT_NEAR(valueOf(solved.value(), "tau_s"), scene.tau(), 1e-12);
    EXPECT_NEAR(valueOf(solved.value(), "effective_diameter_mm"), 31.0, 1e-9);
    const auto& gain = solved->find("gain_matrix")->values;
    for (std::size_t k = 0; k < 9; ++k) {
      EXPECT_NEAR(gain[k], scene.gain(static_cast<Eigen::Index>(k / 3), static_cast<Eigen::Index>(k % 3)), 1e-8);
    }
  }
}

TEST(DelayMultiSpeed, OpposedTouchesAloneGiveASize) {
  std::mt19937_64 random{6};
  Scene scene = simulation::shuffled(simulation::withoutNoise({.bounce_mm = 0.0}), random);
  scene.normals = {{0, 1, 0}, {0, -1, 0}};
  const auto solved = solveDelayMultiSpeed(measure(scene, random));
  ASSERT_TRUE(solved.ok()) << solved.error().reason;
  EXPECT_NEAR(valueOf(solved.value(), "tau_s"), scene.tau(), 1e-9);
  EXPECT_NEAR(valueOf(solved.value(), "effective_diameter_mm"), 31.0, 1e-6);
}

TEST(DelayMultiSpeed, TellsTheStaticErrorOfAKnownSize) {
  std::mt19937_64 random{8};
  Dataset dataset = measure(Scene{}, random);
  dataset.config["effective_diameter_mm"] = 31.002;
  const auto solved = solveDelayMultiSpeed(dataset);
  ASSERT_TRUE(solved.ok());
  EXPECT_NEAR(valueOf(solved.value(), "static_error_mm"), -0.002, 6e-4);
  EXPECT_EQ(sdOf(solved.value(), "static_error_mm"), sdOf(solved.value(), "effective_diameter_mm"));
}

TEST(DelayMultiSpeed, WarnsOfASphereThatIsNotAsStated) {
  std::mt19937_64 random{8};
  Dataset dataset = measure(Scene{}, random);
  dataset.config["effective_diameter_mm"] = 31.0201;
  EXPECT_TRUE(solveDelayMultiSpeed(dataset)->warnings.empty()) << "nobody says how well its size is known";
  dataset.config["sd_effective_diameter_mm"] = 0.0001;
  EXPECT_THAT(solveDelayMultiSpeed(dataset)->warnings,
              testing::ElementsAre(testing::AllOf(testing::HasSubstr("static-error: "), testing::HasSubstr("-20"))));
  dataset.config["sd_stylus_ball_diameter_mm"] = 0.01;
  EXPECT_TRUE(solveDelayMultiSpeed(dataset)->warnings.empty());
}

TEST(DelayMultiSpeed, DoesNotDependOnWhereTheMachineStands) {
  std::mt19937_64 random{9};
  const Dataset dataset = measure(Scene{}, random);
  const Eigen::Matrix3d turn{Eigen::AngleAxisd{0.7, Eigen::Vector3d{1, 2, 3}.normalized()}};
  const auto here = solveDelayMultiSpeed(dataset);
  const auto there = solveDelayMultiSpeed(moved(dataset, turn, {100, -50, 20}));
  ASSERT_TRUE(here.ok() && there.ok());
  EXPECT_NEAR(valueOf(here.value(), "tau_s"), valueOf(there.value(), "tau_s"), 1e-10);
  EXPECT_NEAR(valueOf(here.value(), "effective_diameter_mm"), valueOf(there.value(), "effective_diameter_mm"), 1e-8);
}

TEST(DelayMultiSpeed, DoesNotDependOnTheOrderOfTheTouches) {
  std::mt19937_64 random{10};
  const Dataset dataset = measure(Scene{}, random);
  Dataset turned = dataset;
  for (auto& column : turned.tables[2].columns) std::ranges::reverse(column.values);
  const auto one = solveDelayMultiSpeed(dataset);
  const auto other = solveDelayMultiSpeed(turned);
  ASSERT_TRUE(one.ok() && other.ok());
  EXPECT_NEAR(valueOf(one.value(), "tau_s"), valueOf(other.value(), "tau_s"), 1e-12);
  EXPECT_NEAR(sdOf(one.value(), "tau_s"), sdOf(other.value(), "tau_s"), 1e-12);
}

TEST(DelayMultiSpeed, GivesEqualDigitsForEqualData) {
  std::mt19937_64 random{11};
  const Dataset dataset = measure(Scene{}, random);
  EXPECT_EQ(valueOf(solveDelayMultiSpeed(dataset).value(), "tau_s"),
            valueOf(solveDelayMultiSpeed(dataset).value(), "tau_s"));
}

}  // namespace
}  // namespace probebox::metrology
