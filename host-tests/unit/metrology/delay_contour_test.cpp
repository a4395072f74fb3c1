// The delay from scans along features of any shape: the tip follows the surface, the machine steps towards it and away.
#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <numbers>

#include "cases.hpp"
#include "firmware/metrology/feature_distance.hpp"
#include "scan_simulation.hpp"

namespace probebox::metrology {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

// A place of the surface, and where it faces.
struct Surface {
  Vector3d at;
  Vector3d normal;
};

// A feature as it is walked along: `way` in mm.
struct Feature {
  std::string shape;
  std::function<Surface(double way)> walk;
  Vector3d axis{0.0, 0.0, 0.0};  // none
  Vector3d box{0.0, 0.0, 0.0};   // none
  bool internal{};
};

const Vector3d kCentre{40.0, -25.0, 12.0};

Feature ball() {
  return {"sphere", [](double way) {
            // Down a meridian that leans, and about it.
            const double a = way / 30.0;
            const Vector3d n = Vector3d{std::cos(a), 0.8 * std::sin(a), 0.6 * std::sin(a)}.normalized();
            return Surface{kCentre + 30.0 * n, n};
          }};
}

Feature post(bool bore) {
  const Vector3d axis = Vector3d{0.1, -0.2, 1.0}.normalized();
  const Vector3d across = axis.unitOrthogonal();
  return {"cylinder",
          [=](double way) {
            const Vector3d n = Eigen::AngleAxisd{way / 25.0, axis} * across;
            return Surface{kCentre + 25.0 * n + 0.1 * way * axis, bore ? Vector3d{-n} : n};
          },
          axis, Vector3d::Zero(), bore};
}

Feature face() {
  const Vector3d normal = Vector3d{0.2, 0.3, 0.9}.normalized();
  return {"plane", [=](double way) { return Surface{kCentre + way * normal.unitOrthogonal(), normal}; }, normal};
}

// One of the faces of a gap.
Feature gap() {
  const Vector3d normal = Vector3d{0.2, 0.3, 0.9}.normalized();
  return {"plane-pair",
          [=](double way) {
            return Surface{kCentre + 20.0 * normal + way * normal.unitOrthogonal(), -normal};
          },
          normal, Vector3d::Zero(), true};
}

// Along one face, about the edge and along the next one.
Feature block() {
  const Vector3d size{80.0, 50.0, 40.0};
  return {"box",
          [=](double way) {
            constexpr double kEdge = 3.0;  // mm of way about it
            const double along = 45.0;     // before it
            const Vector3d edge = kCentre + Vector3d{40.0, 25.0, 3.0};
            const double turn = std::clamp((way - along) / kEdge, 0.0, 1.0) * std::numbers::pi / 2.0;
            const Vector3d n{std::cos(turn), std::sin(turn), 0.0};
            const Vector3d before{0.0, std::min(way - along, 0.0), 0.0};
            const Vector3d after{-std::max(way - along - kEdge, 0.0), 0.0, 0.0};
            return Surface{edge + before + after, n};
          },
          Vector3d::Zero(), size};
}

std::vector<Feature> features() {
  return {ball(), post(false), post(true), face(), gap(), block()};
}

struct Scan {
  double tau_s{0.0034};
  double machine_hz{500.0};
  double probe_hz{1000.0};
  double machine_sigma{0.0005};
  double probe_sigma{0.0004};
  double speed{30.0};
  double duration{3.0};
  double step_mm{0.2};
  double rise_s{0.04};
  double stylus_ball{3.0};
  double least_press{0.1};
  std::vector<std::pair<double, double>> steps{{0.3, 0.7}, {1.05, 1.3}, {1.75, 2.6}};
  Vector3d off{0.0, 0.0, 0.0};  // the stated centre from the true one

  static double eased(double share) {
    const double u = std::clamp(share, 0.0, 1.0);
    return u * u * u * (10.0 - 15.0 * u + 6.0 * u * u);
  }
  // How far the tip is pressed.
  double press(double t) const {
    double share = 0.0;
    for (const auto& [from, until] : steps) share += eased((t - from) / rise_s) - eased((t - until) / rise_s);
    return least_press + step_mm * share;
  }
  // (A17b)
  double bound() const {
    const double information = 2.0 * static_cast<double>(steps.size()) * 10.0 / 7.0 * step_mm * step_mm / rise_s;
    return std::sqrt((machine_sigma * machine_sigma / machine_hz + probe_sigma * probe_sigma / probe_hz) / information);
  }
};

std::vector<double> listed(const Vector3d& v) {
  return {v.x(), v.y(), v.z()};
}

Dataset measured(const Feature& feature, const Scan& scan, std::mt19937_64& random) {
  Dataset dataset{
      .method = "delay-contour", .config = {{"shape", feature.shape}, {"search_window_s", 0.05}}, .tables = {}};
  if (feature.shape != "plane") dataset.config["centre_mm"] = listed(kCentre + scan.off);
  if (!feature.axis.isZero()) dataset.config["axis_direction"] = listed(feature.axis);
  if (!feature.box.isZero()) dataset.config["size_axis_mm"] = listed(feature.box);
  if (feature.internal) dataset.config["feature"] = std::string{"internal"};
  addTable(dataset, "scans", {"scan", "speed_mm_s"}).append({0.0, scan.speed});
  const auto surface = [&](double t) { return feature.walk(scan.speed * t); };
  Table machine = Table::withColumns("machine", std::array<std::string_view, 5>{"scan", "t_s", "x_mm", "y_mm", "z_mm"});
  for (double t = uniform(random, 0, 1) / scan.machine_hz; t < scan.duration; t += 1.0 / scan.machine_hz) {
    const Surface here = surface(t - scan.tau_s);
    const Vector3d at = here.at + (scan.stylus_ball - scan.press(t - scan.tau_s)) * here.normal;
    const auto noise = [&] { return gauss(random, scan.machine_sigma); };
    machine.append({0.0, t, at.x() + noise(), at.y() + noise(), at.z() + noise()});
  }
  Table probe = Table::withColumns("probe", std::array<std::string_view, 5>{"scan", "t_s", "a", "b", "c"});
  for (double t = uniform(random, 0, 1) / scan.probe_hz; t < scan.duration; t += 1.0 / scan.probe_hz) {
    const Vector3d bent = scan.press(t) * surface(t).normal;
    const auto noise = [&] { return gauss(random, scan.probe_sigma); };
    probe.append({0.0, t, bent.x() + noise(), bent.y() + noise(), bent.z() + noise()});
  }
  dataset.tables.push_back(std::move(machine));
  dataset.tables.push_back(std::move(probe));
  return dataset;
}

double tauOf(const Dataset& dataset) {
  const auto solved = solve(dataset);
  EXPECT_TRUE(solved.ok()) << solved.error().reason;
  return solved.ok() ? solved->find("tau_s")->value() : std::nan("");
}

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
  EXPECT_THAT(all.pull(), testing::AllOf(testing::Gt(0.84), testing::Lt(1.16)));
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
  EXPECT_THAT(tau.pull(), testing::AllOf(testing::Gt(0.6), testing::Lt(1.4)));
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
  EXPECT_THAT(tau.pull(), testing::AllOf(testing::Gt(0.6), testing::Lt(1.6)));
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
  EXPECT_THAT(tau.pull(), testing::AllOf(testing::Gt(0.5), testing::Lt(1.6)));
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
