// The delay from scans along features of any shape.
#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <numbers>

#include "firmware/metrology/scan/feature_distance.hpp"
#include "host-tests/metrology/contour_simulation.hpp"

namespace probebox::metrology {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using namespace contour;

TEST(FeatureDistance, IsThatOfTheNearestPointOfTheSurface) {
  std::mt19937_64 random{1};
  for (const auto& feature : features()) {
    const Dataset dataset = measured(feature, {}, random);
    const auto distance = featureDistance(dataset);
    ASSERT_TRUE(distance.ok()) << distance.error().reason;
    const double surface = distance->at(feature.walk(0.0).at).mm;  // a size that is not stated
    for (int trial = 0; trial < 50; ++trial) {
      const Surface here = feature.walk(uniform(random, 0.0, 90.0));
      const double off = uniform(random, 0.5, 5.0);
      const auto found = distance->at(here.at + off * here.normal);
      EXPECT_NEAR(found.mm - surface, off, 1e-9) << feature.shape;
      EXPECT_LT((found.normal - here.normal).norm(), 1e-9) << feature.shape;
    }
  }
}

TEST(FeatureDistance, WithinABoxIsNegativeUpToTheNearestFace) {
  const FeatureDistance box{.centre = {1, 2, 3}, .half_mm = {40, 25, 20}};
  const auto found = box.at(Vector3d{1, 2, 3} + Vector3d{-38, 10, 5});
  EXPECT_NEAR(found.mm, -2.0, 1e-12);
  EXPECT_EQ(found.normal, -Vector3d::UnitX());
}

TEST(DelayContour, IsUnbiasedEfficientAndAsUncertainAsItSaysOnEveryShape) {
  std::mt19937_64 random{2};
  constexpr int kTrials = 60;
  const double uncertainty = std::sqrt(2.0 / kTrials);
  Moments all;
  for (const auto& feature : features()) {
    SCOPED_TRACE(feature.shape + (feature.internal ? ", internal" : ""));
    Moments tau;
    for (int trial = 0; trial < kTrials; ++trial) {
      Scan scan;
      scan.tau_s = uniform(random, -0.008, 0.008);
      for (double& off : scan.off) off = gauss(random, 0.005);
      const auto solved = solve(measured(feature, scan, random));
      ASSERT_TRUE(solved.ok()) << solved.error().reason;
      const auto& found = *solved->find("tau_s");
      tau.add(found.value() - scan.tau_s, found.sd[0]);
      all.add(found.value() - scan.tau_s, found.sd[0]);
    }
    EXPECT_THAT(std::pow(Scan{}.bound(), 2) / tau.variance(),
                testing::AllOf(testing::Gt(0.8 * (1.0 - uncertainty)), testing::Lt(1.0 + 4.0 * uncertainty)));
    EXPECT_LT(std::abs(tau.bias()), 4.0);
  }
  expectHonest(all);
}

Moments overScans(int trials, const std::function<Dataset(std::mt19937_64&)>& measure, double tau_s) {
  std::mt19937_64 random{11};
  Moments tau;
  for (int trial = 0; trial < trials; ++trial) {
    const auto solved = solve(measure(random));
    EXPECT_TRUE(solved.ok()) << solved.error().reason;
    if (solved.ok()) tau.add(solved->find("tau_s")->value() - tau_s, solved->find("tau_s")->sd[0]);
  }
  return tau;
}

// About an edge the normals turn for a moment only: what the stated box is off by along the edge's own direction shows
// there alone.
TEST(DelayContour, IsAsUncertainAsItSaysAboutAnEdge) {
  Scan scan;
  scan.off = {0.02, 0.02, 0.0};
  const Moments tau = overScans(
      100, [&](auto& random) { return measured(block(), scan, random); }, scan.tau_s);
  expectHonest(tau);
  EXPECT_GT(std::pow(scan.bound(), 2) / tau.variance(), 0.65);
}

// Stamps that jitter take the streams off each other where the motion is fast, which is what tells the delay: none of
// that is an outlier.
TEST(DelayContour, IsAsUncertainAsItSaysWhereStampsJitter) {
  Scan scan;
  scan.machine_hz = 300.0;
  scan.probe_hz = 500.0;
  const Moments tau = overScans(
      100,
      [&](auto& random) {
        Dataset dataset = measured(face(), scan, random);
        for (const auto* name : {"machine", "probe"}) {
          for (double& stamp : columnNamed(dataset, name, "t_s")) stamp += gauss(random, 2e-4);
        }
        return dataset;
      },
      scan.tau_s);
  expectHonest(tau);
}

TEST(DelayContour, IsExactWithoutNoiseAsFarAsInterpolationGoes) {
  std::mt19937_64 random{3};
  for (const auto& feature : features()) {
    Scan scan;
    scan.machine_sigma = scan.probe_sigma = 0.0;
    EXPECT_NEAR(tauOf(measured(feature, scan, random)), scan.tau_s, 2e-7) << feature.shape;
  }
}

// A scan of a sphere's equator is one contour of many.
TEST(DelayContour, OfASphereIsTheSteppedScan) {
  std::mt19937_64 random{4};
  Dataset dataset = simulation::measure({}, random);
  const auto stepped = solve(dataset);
  dataset.method = "delay-contour";
  dataset.config["shape"] = std::string{"sphere"};
  const auto contour = solve(dataset);
  ASSERT_TRUE(stepped.ok() && contour.ok()) << contour.error().reason;
  EXPECT_EQ(contour->find("tau_s")->values, stepped->find("tau_s")->values);
  EXPECT_EQ(contour->find("tau_s")->sd, stepped->find("tau_s")->sd);
}

// Driven along a line past a ball, 2 mm within its locus of 33 mm; along: mm from the middle at a time.
Dataset drivenPast(const Scan& scan, const std::function<double(double)>& along, std::mt19937_64& random) {
  Dataset dataset = measured(ball(), scan, random);
  for (const auto* name : {"machine", "probe"}) {
    const bool machine = name == std::string{"machine"};
    Table& table = tableNamed(dataset, name);
    for (std::size_t row = 0; row < table.rows(); ++row) {
      const double t = table.columns[1].values[row] - (machine ? scan.tau_s : 0.0);
      const Vector3d at{along(t), 31.0, 0.0};
      const Vector3d value = machine ? Vector3d{kCentre + at} : Vector3d{(33.0 - at.norm()) * at.normalized()};
      const double sigma = machine ? scan.machine_sigma : scan.probe_sigma;
      for (std::size_t k = 0; k < 3; ++k) {
        table.columns[2 + k].values[row] = value[static_cast<Eigen::Index>(k)] + gauss(random, sigma);
      }
    }
  }
  return dataset;
}

TEST(DelayContour, NeedsNoStepsWhereThePathItselfComesNearerAndGoes) {
  std::mt19937_64 random{5};
  constexpr double kTurn = 2.0 * std::numbers::pi;
  Moments tau;
  const Scan scan;
  for (int trial = 0; trial < 60; ++trial) {
    const auto solved = solve(drivenPast(
        scan, [](double t) { return 7.0 * std::sin(kTurn * 0.9 * t) + 2.0 * std::sin(kTurn * 0.37 * t); }, random));
    ASSERT_TRUE(solved.ok()) << solved.error().reason;
    tau.add(solved->find("tau_s")->value() - scan.tau_s, solved->find("tau_s")->sd[0]);
  }
  expectHonest(tau);
  EXPECT_LT(std::abs(tau.bias()), 4.0);
}

// At constant speed to be late looks like a ball that stands elsewhere.
TEST(DelayContour, RefusesAStraightDrivePast) {
  std::mt19937_64 random{10};
  Scan scan;
  scan.duration = 0.8;
  for (int trial = 0; trial < 30; ++trial) {
    EXPECT_EQ(refusalOf(drivenPast(
                  scan, [](double t) { return 20.0 * t - 8.0; }, random)),
              "one-sided");
  }
}

TEST(DelayContour, MayComeFromAProbeThatDoesNotTouch) {
  std::mt19937_64 random{6};
  const Scan scan;
  Dataset dataset = measured(face(), scan, random);
  const double touched = tauOf(dataset);
  Table& probe = tableNamed(dataset, "probe");
  Table distances{"probe", {probe.columns[0], probe.columns[1], {"distance_mm", {}}}};
  for (std::size_t row = 0; row < probe.rows(); ++row) {
    const Vector3d bent{probe.columns[2].values[row], probe.columns[3].values[row], probe.columns[4].values[row]};
    distances.columns[2].values.push_back(9.0 - bent.norm());
  }
  probe = distances;
  dataset.config["probe_kind"] = std::string{"distance"};
  EXPECT_NEAR(tauOf(dataset), touched, 1e-9);
}

TEST(DelayContour, DoesNotDependOnWhereTheFeatureStands) {
  std::mt19937_64 random{7};
  for (const auto& feature : features()) {
    const Dataset dataset = measured(feature, {}, random);
    const double here = tauOf(dataset);
    const bool along_axes = feature.shape == "box";
    const Matrix3d turn =
        along_axes ? Matrix3d::Identity() : Eigen::AngleAxisd{0.9, Vector3d{0.3, 0.5, 0.8}.normalized()}.matrix();
    const Vector3d shift{300.0, -120.0, 55.0};
    Dataset there = dataset;
    const auto apply = [&](Table& table, const Vector3d& by) {
      for (std::size_t row = 0; row < table.rows(); ++row) {
        Vector3d v;
        for (Eigen::Index k = 0; k < 3; ++k) v[k] = table.columns[static_cast<std::size_t>(2 + k)].values[row];
        v = turn * v + by;
        for (Eigen::Index k = 0; k < 3; ++k) table.columns[static_cast<std::size_t>(2 + k)].values[row] = v[k];
      }
    };
    apply(tableNamed(there, "machine"), shift);
    if (dataset.config.contains("centre_mm")) there.config["centre_mm"] = listed(turn * kCentre + shift);
    if (!feature.axis.isZero()) there.config["axis_direction"] = listed(turn * feature.axis);
    EXPECT_NEAR(tauOf(there), here, 1e-9) << feature.shape;
  }
}

TEST(DelayContour, LeavesOutGaps) {
  std::mt19937_64 random{8};
  const Scan scan;
  Dataset dataset = measured(post(true), scan, random);
  const std::vector<double> times = columnNamed(dataset, "machine", "t_s");
  keepRows(tableNamed(dataset, "machine"), [&](std::size_t row) { return times[row] < 1.4 || times[row] > 1.6; });
  EXPECT_NEAR(tauOf(dataset), scan.tau_s, 6.0 * scan.bound());
}

TEST(DelayContour, RefusesByName) {
  std::mt19937_64 random{9};
  const auto refusal = [&](
                           const Feature& feature, const std::function<void(Scan&)>& change,
                           const std::function<void(Dataset&)>& damage = [](Dataset&) {}) {
    Scan scan;
    change(scan);
    Dataset dataset = measured(feature, scan, random);
    damage(dataset);
    return refusalOf(dataset);
  };
  const auto as_is = [](Scan&) {};
  EXPECT_EQ(refusal(face(), as_is), "");
  EXPECT_EQ(refusal(face(), [](Scan& s) { s.step_mm = 0.0; }), "constant-distance");
  // An error of the place alone is no step.
  EXPECT_EQ(refusal(post(false),
                    [](Scan& s) {
                      s.step_mm = 0.0;
                      s.off = {0.1, 0.0, 0.0};
                    }),
            "constant-distance");
  EXPECT_EQ(refusal(post(false), [](Scan& s) { s.least_press = 0.0; }), "contact-lost");
  EXPECT_EQ(refusal(post(false), [](Scan& s) { s.off = {0.4, 0.0, 0.0}; }), "centre-error");
  EXPECT_EQ(refusal(face(), [](Scan& s) { s.tau_s = 0.08; }), "no-peak");
  EXPECT_EQ(refusal(
                face(),
                [](Scan& s) {
                  s.steps.clear();
                  for (int k = 0; k < 14; ++k) s.steps.emplace_back(0.2 * k + 0.05, 0.2 * k + 0.15);
                },
                [](Dataset& d) { d.config["search_window_s"] = 0.15; }),
            "rival-peak");
  EXPECT_EQ(refusal(face(), as_is, [](Dataset& d) { d.config["search_window_s"] = 0.01; }), "window-too-small");
  EXPECT_EQ(refusal(face(), as_is, [](Dataset& d) { d.config["search_window_s"] = 1.6; }), "window-too-large");
  EXPECT_EQ(refusal(face(), as_is, [](Dataset& d) { d.config.erase("search_window_s"); }), "missing-key");
  EXPECT_EQ(refusal(face(), as_is, [](Dataset& d) { d.config.erase("shape"); }), "missing-key");
  EXPECT_EQ(refusal(face(), as_is, [](Dataset& d) { d.config.erase("axis_direction"); }), "missing-key");
  EXPECT_EQ(refusal(post(true), as_is, [](Dataset& d) { d.config.erase("centre_mm"); }), "missing-key");
  EXPECT_EQ(refusal(block(), as_is, [](Dataset& d) { d.config.erase("size_axis_mm"); }), "missing-key");
  EXPECT_EQ(refusal(block(), as_is,
                    [](Dataset& d) {
                      d.config["size_axis_mm"] = std::vector<double>{80, 0, 40};
                    }),
            "bad-config");
  EXPECT_EQ(refusal(face(), as_is, [](Dataset& d) { d.config["shape"] = std::string{"cone"}; }), "bad-config");
  EXPECT_EQ(refusal(face(), as_is,
                    [](Dataset& d) {
                      d.config["axis_direction"] = std::vector<double>{0, 0, 2};
                    }),
            "bad-config");
  EXPECT_EQ(refusal(post(true), as_is, [](Dataset& d) { d.config["feature"] = std::string{"external"}; }), "no-peak")
      << "from without the distance grows where from within it falls";
}

}  // namespace
}  // namespace probebox::metrology
