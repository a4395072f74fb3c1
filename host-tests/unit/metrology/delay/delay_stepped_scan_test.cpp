// The delay from scans whose radius steps, simulated in time, against the bound (A17b).
#include "firmware/metrology/delay/delay_stepped_scan.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <functional>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <random>
#include <string>
#include <vector>

#include "host-tests/metrology/cases.hpp"
#include "host-tests/metrology/moments.hpp"
#include "host-tests/metrology/scan_simulation.hpp"
#include "host-tests/support/runs.hpp"
#include "host-tests/support/sanitized.hpp"

namespace probebox::metrology {
namespace {

using simulation::measure;
using simulation::ScanScene;
using testing::AllOf;
using testing::Gt;
using testing::Lt;

const std::uint64_t kScanTrials = support::kSanitized ? 20 : runs(80);
const double kWider = runsAreComplete() ? 1 : 2;  // limits of what scatters by more than the square root tells

struct ScanSetting {
  std::string name;
  std::function<void(ScanScene&)> change;
};

std::vector<ScanSetting> settings();

// Errors of all settings, in the sd that they state and in the bound (A17b).
struct ScanErrors {
  Moments of_sd, of_bound;
};

void tryOut(const ScanSetting& setting, std::mt19937_64& random, ScanErrors& all) {
  SCOPED_TRACE(setting.name);
  Moments tau;
  for (std::uint64_t trial = 0; trial < kScanTrials; ++trial) {
    ScanScene scene;
    setting.change(scene);
    scene.tau_s = uniform(random, -0.008, 0.008);
    for (double& error : scene.centre_error_mm) error = gauss(random, 0.005);
    const auto solved = solve(measure(scene, random));
    ASSERT_TRUE(solved.ok()) << solved.error().reason;
    const auto& found = *solved->find("tau_s");
    tau.add(found.value() - scene.tau_s, found.sd[0]);
    all.of_sd.add(found.value() - scene.tau_s, found.sd[0]);
    all.of_bound.add(found.value() - scene.tau_s, scene.bound_s());
  }
  EXPECT_THAT(tau.bias(), AllOf(Gt(-4.0), Lt(4.0)));
  expectHonest(tau);
}

TEST(DelayOverRandomScans, IsUnbiasedEfficientAndAsUncertainAsItSays) {
  std::mt19937_64 random{51};
  ScanErrors all;
  for (const auto& setting : settings()) tryOut(setting, random, all);
  expectHonest(all.of_sd);
  // The bound knows of neither jitter nor lost samples.
  const double uncertainty = std::sqrt(2.0 / static_cast<double>(all.of_bound.count));
  EXPECT_THAT(1.0 / all.of_bound.pull(), AllOf(Gt(0.78 * (1.0 - uncertainty)), Lt(1.05 * (1.0 + 3.0 * uncertainty))));
}

std::function<void(ScanScene&)> scanRates(double machine_hz, double probe_hz) {
  return [=](ScanScene& scene) {
    scene.machine_rate_hz = machine_hz;
    scene.probe_rate_hz = probe_hz;
  };
}

std::vector<ScanSetting> settings() {
  return {ScanSetting{"Usual", [](ScanScene&) {}},
          ScanSetting{"FastProbe", scanRates(500.0, 3000.0)},
          ScanSetting{"FastMachine", scanRates(2000.0, 300.0)},
          ScanSetting{"EqualRates", scanRates(700.0, 700.0)},
          ScanSetting{"OneSpeed", [](ScanScene& s) { s.speeds_mm_s = {40.0}; }},
          ScanSetting{"FiveTimesTheNoise",
                      [](ScanScene& s) {
                        s.machine_sigma_mm *= 5.0;
                        s.probe_sigma_mm *= 5.0;
                      }},
          ScanSetting{"NoisyMachine", [](ScanScene& s) { s.machine_sigma_mm *= 5.0; }},
          ScanSetting{"LostSamples", [](ScanScene& s) { s.lost_share = 0.05; }},
          ScanSetting{"Jitter", [](ScanScene& s) { s.stamp_jitter_s = 2e-5; }},
          ScanSetting{"CoarseEncoder", [](ScanScene& s) { s.machine_resolution_mm = 0.001; }},
          ScanSetting{"SmallSphere",
                      [](ScanScene& s) {
                        s.sphere_mm = 8.0;
                        s.outer_mm = 7.85;
                        s.inner_mm = 7.7;
                        s.speeds_mm_s = {10.0, 15.0};
                      }},
          ScanSetting{"CoupledGain",
                      [](ScanScene& s) { s.gain << .98, .01, -.005, -.012, 1.03, .004, .006, -.008, 1.01; }}};
}

TEST(DelaySteppedScan, IsAsUncertainAsItSaysWhereNeighbouringSamplesAreCorrelated) {
  std::mt19937_64 random{57};
  for (const double correlation : {0.5, 0.8}) {
    SCOPED_TRACE(correlation);
    Moments tau;
    for (std::uint64_t trial = 0; trial < kScanTrials; ++trial) {
      ScanScene scene;
      scene.correlation = correlation;
      scene.tau_s = uniform(random, -0.008, 0.008);
      const auto solved = solve(measure(scene, random));
      ASSERT_TRUE(solved.ok()) << solved.error().reason;
      EXPECT_THAT(solved->warnings, testing::Contains(testing::HasSubstr("are correlated")));
      tau.add(solved->find("tau_s")->value() - scene.tau_s, solved->find("tau_s")->sd[0]);
    }
    // Longer correlation than a block shows is seen in part: without it the mean square is 9.
    if (correlation > 0.5) {
      EXPECT_THAT(tau.pull(), AllOf(Gt(0.7 / kWider), Lt(2.0 * kWider)));
    } else {
      expectHonest(tau);
    }
  }
}

ScanScene withoutNoise() {
  ScanScene scene;
  scene.machine_sigma_mm = scene.probe_sigma_mm = 0.0;
  return scene;
}

// Without noise only interpolation errs: with the fourth power of the period.
TEST(DelaySteppedScan, IsExactWithoutNoiseAsFarAsInterpolationGoes) {
  std::mt19937_64 random{52};
  for (const auto& [faster, error_s] : {std::pair{1.0, 1e-7}, std::pair{4.0, 1e-8}}) {
    ScanScene scene = withoutNoise();
    scene.machine_rate_hz *= faster;
    scene.probe_rate_hz *= faster;
    EXPECT_NEAR(tauOf(measure(scene, random)), scene.tau_s, error_s);
  }
}

// Least squares of all there is, by another way: the shift tried out that leaves the least scatter of r + g delta on 1,
// cos and sin. Without noise, for noise draws least squares aside.
TEST(DelaySteppedScan, AgreesWithASearchForTheLeastScatter) {
  std::mt19937_64 random{53};
  ScanScene scene = withoutNoise();
  scene.speeds_mm_s = {50.0};
  scene.machine_rate_hz = scene.probe_rate_hz = 2000.0;
  const Dataset dataset = measure(scene, random);
  const auto column = [&](std::string_view table, std::string_view name) {
    return *dataset.table(table)->column(name);
  };
  const auto mt = column("machine", "t_s"), x = column("machine", "x_mm"), y = column("machine", "y_mm");
  const auto pt = column("probe", "t_s"), a = column("probe", "a"), b = column("probe", "b");
  const auto scatter = [&](double tau) {
    Eigen::MatrixXd rows{static_cast<Eigen::Index>(mt.size()), 4};
    Eigen::VectorXd r{rows.rows()};
    Eigen::Index used = 0;
    for (std::size_t k = 0; k < mt.size(); ++k) {
      const auto next = std::ranges::upper_bound(pt, mt[k] - tau);
      if (next == pt.begin() || next == pt.end()) continue;
      const auto j = static_cast<std::size_t>(next - pt.begin());
      const double w = (mt[k] - tau - pt[j - 1]) / (pt[j] - pt[j - 1]);
      const Eigen::Vector2d arm{x[k] - scene.centre_mm.x(), y[k] - scene.centre_mm.y()};
      const double delta = (1 - w) * std::hypot(a[j - 1], b[j - 1]) + w * std::hypot(a[j], b[j]);
      rows.row(used) << delta, 1.0, arm.normalized().transpose();
      r[used++] = arm.norm();
    }
    const Eigen::MatrixXd design = rows.topRows(used);
    const Eigen::VectorXd values = r.head(used);
    const Eigen::VectorXd solution = (design.transpose() * design).ldlt().solve(design.transpose() * values);
    return (values - design * solution).squaredNorm() / static_cast<double>(used);
  };
  double best = 0.0;
  for (double tau = -0.01; tau < 0.01; tau += 2e-4) {
    if (scatter(tau) < scatter(best)) best = tau;
  }
  for (double step = 1e-4; step > 1e-7; step /= 2.0) {
    for (const double tried : {best - step, best + step}) {
      if (scatter(tried) < scatter(best)) best = tried;
    }
  }
  EXPECT_NEAR(tauOf(dataset), best, 2e-6);
}

// Elsewhere, turned about the sphere's axis, at other times, or with another unit of the probe: the same delay.
TEST(DelaySteppedScan, DoesNotDependOnWhereAndWhenTheMachineStands) {
  std::mt19937_64 random{54};
  ScanScene scene;
  const Dataset dataset = measure(scene, random);
  const double here = tauOf(dataset);
  Dataset there = dataset;
  const Eigen::Rotation2Dd turn{0.7};
  for (auto& table : there.tables) {
    if (table.name == "scans") continue;
    for (std::size_t row = 0; row < table.rows(); ++row) {
      table.columns[1].values[row] += 1000.0;
      Eigen::Vector2d v{table.columns[2].values[row], table.columns[3].values[row]};
      v = turn * v;
      table.columns[2].values[row] = v.x() + (table.name == "machine" ? 100.0 : 0.0);
      table.columns[3].values[row] = v.y();
    }
  }
  const auto& stated = std::get<std::vector<double>>(dataset.config.at("centre_mm"));
  const Eigen::Vector2d centre = turn * Eigen::Vector2d{stated[0], stated[1]};
  there.config["centre_mm"] = std::vector<double>{centre.x() + 100.0, centre.y(), stated[2]};
  EXPECT_NEAR(tauOf(there), here, 1e-9);
  Dataset scaled = dataset;
  for (const auto* channel : {"a", "b", "c"}) {
    for (double& value : columnNamed(scaled, "probe", channel)) value *= 1000.0;
  }
  scaled.config["gain_matrix"] = Matrix{{0.001, 0, 0}, {0, 0.001, 0}, {0, 0, 0.001}};
  EXPECT_NEAR(tauOf(scaled), here, 1e-12);
}

// What comes earlier in the stamps goes into the answer one to one, and a previous delay is added.
TEST(DelaySteppedScan, FollowsTheStampsAndAddsThePreviousDelay) {
  std::mt19937_64 random{55};
  Dataset dataset = measure(ScanScene{}, random);
  const double tau = tauOf(dataset);
  for (double& time : columnNamed(dataset, "machine", "t_s")) time -= 0.003;
  EXPECT_NEAR(tauOf(dataset), tau - 0.003, 1e-8);
  dataset.config["previous_tau_s"] = 0.003;
  const auto solved = solve(dataset);
  EXPECT_NEAR(solved->find("tau_s")->value(), tau, 1e-8);
  EXPECT_NEAR(solved->find("residual_tau_s")->value(), tau - 0.003, 1e-8);
}

// A probe that reads the distance from the sphere in place of a deflection.
TEST(DelaySteppedScan, MayComeFromAProbeThatDoesNotTouch) {
  std::mt19937_64 random{61};
  Moments tau;
  for (std::uint64_t trial = 0; trial < kScanTrials; ++trial) {
    const ScanScene scene;
    Dataset dataset = measure(scene, random);
    Table& probe = tableNamed(dataset, "probe");
    Table distances{"probe", {probe.columns[0], probe.columns[1], {"distance_mm", {}}}};
    for (std::size_t row = 0; row < probe.columns[0].values.size(); ++row) {
      const double pressed = std::hypot(probe.columns[2].values[row], probe.columns[3].values[row]);
      distances.columns[2].values.push_back(7.0 - pressed);
    }
    probe = distances;
    EXPECT_EQ(metrology::refusalOf(dataset), "missing-column");
    dataset.config["probe_kind"] = std::string{"distance"};
    const auto solved = solve(dataset);
    ASSERT_TRUE(solved.ok()) << solved.error().reason;
    tau.add(solved->find("tau_s")->value() - scene.tau_s, *solved->find("tau_s")->standardDeviation());
  }
  EXPECT_LT(tau.variance(), 2.0 * kWider * std::pow(ScanScene{}.bound_s(), 2));
  EXPECT_LT(std::abs(tau.bias()), 4.0);
  expectHonest(tau);
}

// Stretches without samples, spikes: the rest answers as well as it can.
TEST(DelaySteppedScan, LeavesOutGapsAndSpikes) {
  std::mt19937_64 random{56};
  for (const auto* stream : {"machine", "probe"}) {
    Moments tau;
    for (std::uint64_t trial = 0; trial < kScanTrials; ++trial) {
      const ScanScene scene;
      Dataset dataset = measure(scene, random);
      const double from = uniform(random, 0.2, 1.2);
      const std::vector<double> times = columnNamed(dataset, stream, "t_s");
      keepRows(tableNamed(dataset, stream),
               [&](std::size_t row) { return times[row] < from || times[row] > from + 0.1; });
      columnNamed(dataset, stream, stream == std::string{"probe"} ? "a" : "x_mm")[700] += 0.05;
      const auto solved = solve(dataset);
      ASSERT_TRUE(solved.ok()) << solved.error().reason;
      EXPECT_FALSE(solved->dropped.empty());
      tau.add(solved->find("tau_s")->value() - scene.tau_s, *solved->find("tau_s")->standardDeviation());
    }
    SCOPED_TRACE(testing::Message() << stream);
    expectHonest(tau);
    EXPECT_LT(std::abs(tau.bias()), 4.0) << stream;
  }
}

std::string refusalOf(const std::function<void(ScanScene&)>& change) {
  std::mt19937_64 random{57};
  ScanScene scene;
  change(scene);
  return refusalOf(measure(scene, random));
}

TEST(DelaySteppedScan, IsRefusedWhenTheMotionDoesNotTellTheDelay) {
  EXPECT_EQ(refusalOf([](ScanScene& s) { s.inner_mm = s.outer_mm; }), "constant-radius");
  EXPECT_EQ(refusalOf([](ScanScene& s) { s.inner_mm = s.outer_mm - 1e-5; }), "constant-radius");
  // An error of the centre alone is no step.
  EXPECT_EQ(refusalOf([](ScanScene& s) {
              s.inner_mm = s.outer_mm;
              s.centre_error_mm.x() = 0.1;
            }),
            "constant-radius");
  EXPECT_EQ(refusalOf([](ScanScene& s) { s.outer_mm = s.sphere_mm; }), "contact-lost");
  EXPECT_EQ(refusalOf([](ScanScene& s) { s.outer_mm = s.sphere_mm + 0.05; }), "contact-lost");
  EXPECT_EQ(refusalOf([](ScanScene& s) { s.centre_error_mm.y() = 0.3; }), "centre-error");
}

TEST(DelaySteppedScan, IsRefusedWhenSeveralDelaysFit) {
  const auto periodic = [](double window_s, std::vector<double> speeds) {
    return [=](ScanScene& s) {
      s.arcs_rad.clear();
      for (int k = 0; k < 6; ++k)
        s.arcs_rad.emplace_back(0.2 + k * std::numbers::pi / 3.0, 0.7 + k * std::numbers::pi / 3.0);
      s.speeds_mm_s = speeds;
      s.window_s = window_s;
    };
  };
  // The pattern repeats after 0.27 s.
  EXPECT_EQ(refusalOf(periodic(0.30, {60.0})), "rival-peak");
  EXPECT_EQ(refusalOf(periodic(0.15, {60.0})), "rival-peak");
  EXPECT_EQ(refusalOf(periodic(0.10, {60.0})), "");
  // Several speeds repeat after different times.
  EXPECT_EQ(refusalOf(periodic(0.30, {20.0, 37.0, 60.0})), "");
  // Unequal arcs do not.
  EXPECT_EQ(refusalOf([](ScanScene& s) {
              s.speeds_mm_s = {60.0};
              s.window_s = 0.3;
            }),
            "");
}

TEST(DelaySteppedScan, IsRefusedWhenTheWindowDoesNotSuit) {
  EXPECT_EQ(refusalOf([](ScanScene& s) { s.window_s = 0.01; }), "window-too-small");
  EXPECT_EQ(refusalOf([](ScanScene& s) { s.window_s = 0.9; }), "window-too-large");
  EXPECT_EQ(refusalOf([](ScanScene& s) { s.tau_s = 0.08; }), "no-peak");
}

TEST(DelaySteppedScan, IsRefusedWhenTheRecordIsBad) {
  std::mt19937_64 random{58};
  const Dataset good = measure(ScanScene{}, random);
  const auto refusal = [&](const std::function<void(Dataset&)>& damage) {
    Dataset dataset = good;
    damage(dataset);
    return metrology::refusalOf(dataset);
  };
  ASSERT_EQ(metrology::refusalOf(good), "");
  EXPECT_EQ(refusal([](Dataset& d) { d.config.erase("centre_mm"); }), "missing-key");
  EXPECT_EQ(refusal([](Dataset& d) { d.config.erase("search_window_s"); }), "missing-key");
  EXPECT_EQ(refusal([](Dataset& d) { d.config["gain_matrix"] = Matrix{{1, 0, 0}, {0, 1, 0}}; }), "bad-config");
  EXPECT_EQ(refusal([](Dataset& d) { d.config["probe_kind"] = std::string{"sound"}; }), "bad-config");
  EXPECT_EQ(refusal([](Dataset& d) { d.config["probe_kind"] = std::string{"distance"}; }), "missing-column");
  EXPECT_EQ(refusal([](Dataset& d) { columnNamed(d, "machine", "scan")[5] = 7.0; }), "unknown-scan");
  EXPECT_EQ(refusal([](Dataset& d) { columnNamed(d, "scans", "scan")[1] = 0.0; }), "unknown-scan");
  EXPECT_EQ(refusal([](Dataset& d) { columnNamed(d, "scans", "speed_mm_s")[1] = -40.0; }), "bad-speed");
  EXPECT_EQ(refusal([](Dataset& d) { columnNamed(d, "probe", "a")[70] = std::nan(""); }), "not-finite");
  EXPECT_EQ(
      refusal([](Dataset& d) { std::swap(columnNamed(d, "probe", "t_s")[70], columnNamed(d, "probe", "t_s")[71]); }),
      "time-not-rising");
  EXPECT_EQ(refusal([](Dataset& d) { keepRows(tableNamed(d, "probe"), [](std::size_t row) { return row > 4600; }); }),
            "too-few-samples");
  // The probe knows nothing of the machine's motion.
  EXPECT_EQ(refusal([](Dataset& d) {
              for (auto& column : tableNamed(d, "probe").columns) {
                if (column.name != "t_s" && column.name != "scan") std::ranges::reverse(column.values);
              }
            }),
            "no-peak");
}

TEST(DelaySteppedScan, IsRefusedWhenTheTipSlips) {
  std::mt19937_64 random{59};
  Dataset dataset = measure(ScanScene{}, random);
  const auto& times = columnNamed(dataset, "probe", "t_s");
  for (std::size_t k = 0; k < times.size(); ++k) {
    columnNamed(dataset, "probe", "a")[k] *= 1.0 + 0.1 * std::sin(40.0 * times[k]);
    columnNamed(dataset, "probe", "b")[k] *= 1.0 + 0.1 * std::sin(40.0 * times[k]);
  }
  EXPECT_EQ(metrology::refusalOf(dataset), "residual-too-large");
}

TEST(DelaySteppedScan, IsRefusedWhenAScanIsACopy) {
  std::mt19937_64 random{60};
  ScanScene scene;
  scene.speeds_mm_s = {40.0};
  Dataset dataset = measure(scene, random);
  for (const auto* name : {"machine", "probe", "scans"}) {
    Table& table = tableNamed(dataset, name);
    for (auto& column : table.columns) {
      const std::vector<double> once = column.values;
      column.values.insert(column.values.end(), once.begin(), once.end());
    }
    auto& ids = table.columns.front().values;
    std::fill(ids.begin() + static_cast<std::ptrdiff_t>(ids.size() / 2), ids.end(), 1.0);
  }
  EXPECT_EQ(metrology::refusalOf(dataset), "duplicated-reading");
}

}  // namespace
}  // namespace probebox::metrology
