// Encoders with coarse steps: at constant speed their rounding is no noise of single samples.
#include "firmware/metrology/touch/quantisation.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <numbers>

#include "host-tests/metrology/cases.hpp"
#include "host-tests/metrology/touch_simulation.hpp"
#include "host-tests/support/runs.hpp"

namespace probebox::metrology {
namespace {

using simulation::Scene;

struct Axis {
  double step_mm{0.005};
  double speed_mm_s{25.0};
  double noise_mm{0.0005};
  std::size_t samples{40};
  double period_s{0.002};
};

std::vector<double> stampsOf(const Axis& axis) {
  std::vector<double> times;
  for (std::size_t k = 0; k < axis.samples; ++k) times.push_back(static_cast<double>(k) * axis.period_s);
  return times;
}

// The line through rounded positions, that were true to a start and the speed.
Line roundedLine(const Axis& axis, double start, std::mt19937_64& random) {
  const auto times = stampsOf(axis);
  Rows3 values = Rows3::Zero(static_cast<Eigen::Index>(times.size()), 3);
  for (std::size_t k = 0; k < times.size(); ++k) {
    const double at = start + axis.speed_mm_s * times[k] + gauss(random, axis.noise_mm);
    values(static_cast<Eigen::Index>(k), 0) = axis.step_mm * std::round(at / axis.step_mm);
  }
  return fitLine(times, values);
}

// Variances as they are found over many starts.
struct Found {
  double mean{};
  double slope{};
  double both{};
  double residual{};
};

Found foundOver(const Axis& axis, std::mt19937_64& random) {
  constexpr int kTrials = 20000;
  Found found;
  for (int trial = 0; trial < kTrials; ++trial) {
    const double start = uniform(random, 0.0, axis.step_mm);
    const Line line = roundedLine(axis, start, random);
    const double mean = line.mean.x() - start - axis.speed_mm_s * line.t_mean;
    const double slope = line.slope.x() - axis.speed_mm_s;
    found.mean += mean * mean / kTrials;
    found.slope += slope * slope / kTrials;
    found.both += mean * slope / kTrials;
    found.residual += line.scatter(0, 0) / static_cast<double>(line.n - 2) / kTrials;
  }
  return found;
}

// Whole steps a period, nearly so, and nothing of the kind; noise from a fiftieth of a step to a third.
TEST(QuantisationError, MovesALineByAsMuchAsItSays) {
  std::mt19937_64 random{1};
  for (const Axis& axis : {Axis{}, Axis{.speed_mm_s = 25.05}, Axis{.speed_mm_s = 18.3}, Axis{.noise_mm = 0.0001},
                           Axis{.speed_mm_s = 25.03, .noise_mm = 0.0017}, Axis{.speed_mm_s = 1.01, .samples = 25}}) {
    const Found found = foundOver(axis, random);
    const Line line = roundedLine(axis, 0.0, random);
    Line exact = line;
    exact.slope = {axis.speed_mm_s, 0, 0};
    const QuantisationError rounding{stampsOf(axis), exact, {axis.step_mm, 0, 0}};
    const auto share = rounding.shareOf(0, axis.noise_mm);
    const double own = rounding.ownVariance(0, axis.noise_mm);
    const double mean = share.mean + own / static_cast<double>(line.n);
    const double slope = share.slope + own / line.sxx;
    EXPECT_NEAR(found.mean / mean, 1.0, 0.06) << axis.speed_mm_s << " " << axis.noise_mm;
    EXPECT_NEAR(found.slope / slope, 1.0, 0.08) << axis.speed_mm_s << " " << axis.noise_mm;
    EXPECT_NEAR(found.both, share.both, 0.05 * std::sqrt(mean * slope));
    EXPECT_NEAR(found.residual / (own + share.residual), 1.0, 0.06) << axis.speed_mm_s << " " << axis.noise_mm;
  }
}

TEST(QuantisationError, IsNothingWithoutSteps) {
  std::mt19937_64 random{2};
  const Line line = roundedLine({.step_mm = 1e-7}, 0.0, random);
  const QuantisationError rounding{stampsOf({}), line, {0, 0, 0}};
  EXPECT_EQ(rounding.shareOf(0, 1e-4).mean, 0.0);
  EXPECT_EQ(rounding.ownVariance(0, 1e-4), 1e-8);
}

TEST(QuantisationError, TellsTheNoiseBeforeItFromTheResiduals) {
  std::mt19937_64 random{3};
  for (const double speed : {25.0, 25.05, 18.3}) {
    const Axis axis{.speed_mm_s = speed, .noise_mm = 0.0008};
    std::vector<Line> lines;
    std::vector<QuantisationError> roundings;
    for (int k = 0; k < 400; ++k) {
      lines.push_back(roundedLine(axis, uniform(random, 0.0, axis.step_mm), random));
      roundings.emplace_back(stampsOf(axis), lines.back(), Eigen::Vector3d{axis.step_mm, 0, 0});
    }
    EXPECT_NEAR(noiseBeforeRounding(lines, roundings) / axis.noise_mm, 1.0, 0.15) << speed;
  }
}

// At 25 mm/s and 500 samples/s a period takes ten steps of 5 um: all samples of a retract are rounded alike.
TEST(QuantisationError, LeavesADelayAsUncertainAsItSays) {
  std::mt19937_64 random{4};
  for (const double step_mm : {0.001, 0.002, 0.005}) {
    for (const double speed : {25.0, 18.2765}) {
      Moments tau;
      for (std::uint64_t trial = 0; trial < runs(150); ++trial) {
        Scene scene = simulation::shuffled(trial % 2 == 0 ? simulation::knownSphere() : simulation::plates(), random);
        scene.machine_resolution_mm = step_mm;
        scene.speeds_mm_s = {speed};
        const auto solved = solve(measure(scene, random));
        ASSERT_TRUE(solved.ok()) << solved.error().reason;
        tau.add(solved->find("tau_s")->value() - scene.tau(), *solved->find("tau_s")->standardDeviation());
      }
      SCOPED_TRACE(testing::Message() << step_mm << " " << speed);
      expectHonest(tau);
      EXPECT_LT(std::abs(tau.bias()), 4.0);
    }
  }
}

void roundProbe(Dataset& dataset, double step) {
  for (const char* const channel : {"a", "b", "c"})
    for (auto& value : columnNamed(dataset, "probe", channel)) value = step * std::round(value / step);
}

// The deflections of a converter with steps: rounded alike where a period takes whole steps, and no spikes, however few
// of them are rounded otherwise.
TEST(QuantisationError, OfTheProbeLeavesADelayAsUncertainAsItSays) {
  std::mt19937_64 random{7};
  for (const double step : {0.001, 0.002, 0.005, 0.025}) {
    for (const double speed : {25.0, 18.2765}) {
      Moments tau;
      for (std::uint64_t trial = 0; trial < runs(150); ++trial) {
        Scene scene = simulation::shuffled(trial % 2 == 0 ? simulation::knownSphere() : simulation::plates(), random);
        scene.speeds_mm_s = {speed};
        Dataset dataset = measure(scene, random);
        roundProbe(dataset, step);
        const auto solved = solve(dataset);
        ASSERT_TRUE(solved.ok()) << step << " " << speed << ": " << solved.error().reason;
        tau.add(solved->find("tau_s")->value() - scene.tau(), *solved->find("tau_s")->standardDeviation());
      }
      SCOPED_TRACE(testing::Message() << step << " " << speed);
      if (step <= 0.002) {
        expectHonest(tau);
        continue;
      }
      // Steps far above the noise leave a sawtooth whose harmonics are not independent.
      EXPECT_LT(tau.pull(), 3.0);
      EXPECT_GT(tau.pull(), 0.2);
    }
  }
}

// In and out are rounded each in a way of their own, which looks like a delay.
TEST(QuantisationError, LeavesADriveInAndOutAsUncertainAsItSays) {
  std::mt19937_64 random{6};
  for (const double step_mm : {0.002, 0.005}) {
    for (const double speed : {25.0, 18.2765}) {
      Moments tau;
      for (int trial = 0; trial < 250; ++trial) {
        Scene scene = simulation::knownSphere();
        scene.method = "delay-in-out";
        scene.normals = {{1, 0, 0}};
        scene.dwell_s = 0.0;
        scene.bounce_mm = 0.0;
        scene = simulation::shuffled(scene, random);
        scene.machine_resolution_mm = step_mm;
        scene.speeds_mm_s = {speed};
        Dataset dataset = measure(scene, random);
        dataset.config.clear();
        const auto solved = solve(dataset);
        ASSERT_TRUE(solved.ok()) << solved.error().reason;
        tau.add(solved->find("tau_s")->value() - scene.tau(), *solved->find("tau_s")->standardDeviation());
      }
      SCOPED_TRACE(testing::Message() << step_mm << " " << speed);
      expectHonest(tau);
      EXPECT_LT(std::abs(tau.bias()), 4.0);
    }
  }
}

TEST(QuantisationError, LeavesTheDelayOfSeveralSpeedsAsUncertainAsItSays) {
  std::mt19937_64 random{5};
  Moments tau;
  for (std::uint64_t trial = 0; trial < runs(120); ++trial) {
    Scene scene = simulation::shuffled({}, random);
    scene.machine_resolution_mm = 0.005;
    const auto solved = solve(measure(scene, random));
    ASSERT_TRUE(solved.ok()) << solved.error().reason;
    tau.add(solved->find("tau_s")->value() - scene.tau(), *solved->find("tau_s")->standardDeviation());
  }
  expectHonest(tau);
}

}  // namespace
}  // namespace probebox::metrology
