// The delay from scans whose radius steps, simulated in time.
#include "firmware/metrology/delay_stepped_scan.hpp"

#include <array>
#include <cmath>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <numbers>
#include <random>
#include <string>

#include "moments.hpp"

namespace probebox::metrology {
namespace {

constexpr double kTau = 0.0034;

struct Scene {
  double noise{1.0};
  double inner_mm{15.2};
  double outer_mm{15.4};
  double centre_error_mm{0.01};
  double window_s{0.05};
};

// Radius over the angle: lower on three unequal arcs, with ramps of half a degree.
double radiusAt(const Scene& scene, double angle) {
  double share = 0.0;
  for (const auto& [from, until] : {std::pair{0.7, 1.05}, {1.75, 2.53}, {3.58, 4.89}}) {
    share += 0.5 * (std::tanh((angle - from) / 0.01) - std::tanh((angle - until) / 0.01));
  }
  return scene.outer_mm - share * (scene.outer_mm - scene.inner_mm);
}

Dataset scans(const Scene& scene, std::mt19937_64& random) {
  constexpr std::array<std::string_view, 5> kMachine{"scan", "t_s", "x_mm", "y_mm", "z_mm"};
  constexpr std::array<std::string_view, 5> kProbe{"scan", "t_s", "a", "b", "c"};
  constexpr std::array<std::string_view, 2> kScans{"scan", "speed_mm_s"};
  Dataset dataset{.method = "delay-stepped-scan",
                  .config = {{"centre_mm", std::vector<double>{50.0 + scene.centre_error_mm, -20.0, 5.0}},
                             {"search_window_s", scene.window_s}},
                  .tables = {Table::withColumns("machine", kMachine), Table::withColumns("probe", kProbe),
                             Table::withColumns("scans", kScans)}};
  std::normal_distribution<double> normal;
  const auto bodyAt = [&](double t, double speed) {
    const double angle = std::fmod(std::max(t, 0.0) * speed / 15.4, 2.0 * std::numbers::pi);
    return std::pair{radiusAt(scene, angle), angle};
  };
  double scan = 0.0;
  for (const double speed : {40.0, 60.0}) {
    const double turn = 2.0 * std::numbers::pi * 15.4 / speed;
    for (double t = 0.0003 + kTau; t < turn; t += 0.002) {
      const auto [r, angle] = bodyAt(t - kTau, speed);
      const auto n = [&] { return scene.noise * 0.0005 * normal(random); };
      dataset.tables[0].append(
          {scan, t, 50.0 + r * std::cos(angle) + n(), -20.0 + r * std::sin(angle) + n(), 5.0 + n()});
    }
    for (double t = 0.0001; t < turn; t += 0.001) {
      const auto [r, angle] = bodyAt(t, speed);
      const auto n = [&] { return scene.noise * 0.0004 * normal(random); };
      dataset.tables[1].append({scan, t, (15.5 - r) * std::cos(angle) + n(), (15.5 - r) * std::sin(angle) + n(), n()});
    }
    dataset.tables[2].append({scan, speed});
    ++scan;
  }
  return dataset;
}

TEST(DelaySteppedScan, IsUnbiasedAndAsUncertainAsItSays) {
  std::mt19937_64 random{51};
  Moments tau;
  for (int trial = 0; trial < 60; ++trial) {
    const auto solved = solveDelaySteppedScan(scans({}, random));
    ASSERT_TRUE(solved.ok()) << solved.error().reason;
    tau.add(solved->find("tau_s")->value() - kTau, *solved->find("tau_s")->standardDeviation());
  }
  EXPECT_LT(std::abs(tau.bias()), 4.0);
  EXPECT_GT(tau.pull(), 0.5);
  EXPECT_LT(tau.pull(), 1.6);
  EXPECT_LT(tau.variance(), 1e-10);
}

TEST(DelaySteppedScan, IsRefusedByName) {
  std::mt19937_64 random{52};
  const auto refusal = [&](const Scene& scene) {
    const auto solved = solveDelaySteppedScan(scans(scene, random));
    return solved.ok() ? "solved" : solved.error().name;
  };
  EXPECT_EQ(refusal({.inner_mm = 15.4}), "constant-radius");
  EXPECT_EQ(refusal({.outer_mm = 15.5}), "contact-lost");
  EXPECT_EQ(refusal({.centre_error_mm = 0.4}), "centre-error");
  EXPECT_EQ(refusal({.window_s = 0.01}), "window-too-small");
  EXPECT_EQ(refusal({.window_s = 0.9}), "window-too-large");
}

}  // namespace
}  // namespace probebox::metrology
