// The delay from touches of any feature, with a threshold in place of the slope, and on a workpiece that moves.
#include "firmware/metrology/delay/delay_feature.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <functional>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <map>
#include <string>

#include "firmware/metrology/delay/surface_points.hpp"
#include "host-tests/metrology/cases.hpp"
#include "host-tests/metrology/moments.hpp"
#include "host-tests/metrology/touch_simulation.hpp"
#include "host-tests/support/sanitized.hpp"

namespace probebox::metrology {
namespace {

using Eigen::Vector3d;
using simulation::Scene;
using testing::AllOf;
using testing::Gt;
using testing::Lt;

constexpr int kFeatureTrials = support::kSanitized ? 5 : 200;
constexpr int kRounds = support::kSanitized ? 20 : 160;

// A set-up of the simulation, and where every touched place of a sphere is moved to, to make it another feature.
struct Arrangement {
  std::string name;
  Scene scene;
  std::map<std::string, Value, std::less<>> config;
  std::function<Vector3d(const Vector3d& normal)> moved_by;
};

void PrintTo(const Arrangement& setup, std::ostream* out) {
  *out << setup.name;
}

Dataset measure(const Arrangement& setup, const Scene& scene, std::mt19937_64& random) {
  Dataset dataset = simulation::measure(scene, random);
  dataset.method = "delay-feature";
  dataset.config = setup.config;
  Table& machine = tableNamed(dataset, "machine");
  const Table& touches = tableNamed(dataset, "touches");
  for (std::size_t row = 0; row < machine.columns[0].values.size(); ++row) {
    const auto touch = static_cast<std::size_t>(machine.columns[0].values[row]);
    const auto cell = [&](std::size_t column) { return touches.columns[column].values[touch]; };
    const Vector3d by = setup.moved_by({cell(1), cell(2), cell(3)});
    for (std::size_t k = 0; k < 3; ++k) machine.columns[2 + k].values[row] += by[static_cast<Eigen::Index>(k)];
  }
  return dataset;
}

Scene oneSpeed() {
  Scene scene = simulation::knownSphere();
  scene.normals = {{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}};
  return scene;
}

Scene touching(Scene scene, std::vector<Vector3d> normals, std::vector<double> speeds) {
  scene.normals = std::move(normals);
  scene.speeds_mm_s = std::move(speeds);
  return scene;
}

Scene fromWithin(Scene scene) {
  scene.radius_mm = -12.0;
  return scene;
}

Scene offNormal(Scene scene) {
  scene.approach_rad = 0.6;
  return scene;
}

Vector3d stay(const Vector3d&) {
  return Vector3d::Zero();
}
// Around an axis along Z, at different heights.
Vector3d alongZ(const Vector3d& normal) {
  return {0.0, 0.0, 10.0 * normal.x() + 5.0 * normal.y()};
}
// Half sizes 20, 10 and 5 mm where the sphere has 15.5.
Vector3d toBox(const Vector3d& normal) {
  return normal.cwiseProduct(Vector3d{20.0 - 15.5, 10.0 - 15.5, 5.0 - 15.5});
}

const std::vector<Vector3d> kRound{{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0.8, 0.6, 0}};
const Value kZ{std::vector<double>{0, 0, 1}};

std::vector<Arrangement> setups() {
  return {
      {"Sphere", oneSpeed(), {{"shape", "sphere"}, {"size_mm", 31.0}}, stay},
      {"SphereOfUnknownSize", touching(oneSpeed(), oneSpeed().normals, {10.0, 30.0}), {{"shape", "sphere"}}, stay},
      {"Cylinder",
       touching(oneSpeed(), kRound, {25.0}),
       {{"shape", "cylinder"}, {"size_mm", 31.0}, {"axis_direction", kZ}},
       alongZ},
      {"Bore",
       touching(fromWithin(oneSpeed()), {{-1, 0, 0}, {1, 0, 0}, {0, -1, 0}, {0, 1, 0}}, {25.0}),
       {{"shape", "cylinder"}, {"size_mm", 24.0}, {"axis_direction", kZ}},
       alongZ},
      {"PlanePair",
       touching(oneSpeed(), {{0.6, 0.8, 0}, {-0.6, -0.8, 0}, {0.6, 0.8, 0}}, {25.0}),
       {{"shape", "plane-pair"}, {"size_mm", 31.0}},
       stay},
      {"Box",
       touching(oneSpeed(), {{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}}, {25.0}),
       {{"shape", "box"}, {"size_axis_mm", std::vector<double>{40, 20, 10}}},
       toBox},
      {"OnePointAtSeveralSpeeds", touching(oneSpeed(), {{0, 0, 1}}, {5, 10, 20, 30, 40}), {{"shape", "plane"}}, stay},
      {"Threshold", oneSpeed(), {{"shape", "sphere"}, {"size_mm", 31.0}, {"threshold_mm", 0.05}}, stay},
      {"ThresholdWithin",
       touching(fromWithin(oneSpeed()), {{-1, 0, 0}, {1, 0, 0}, {0, -1, 0}, {0, 1, 0}}, {25.0}),
       {{"shape", "cylinder"}, {"size_mm", 24.0}, {"axis_direction", kZ}, {"threshold_mm", 0.1}},
       alongZ},
      {"ThresholdOffTheNormal",
       offNormal(oneSpeed()),
       {{"shape", "sphere"}, {"size_mm", 31.0}, {"threshold_mm", 0.05}},
       stay},
      {"ThresholdOnABoxOffTheNormal",
       offNormal(touching(oneSpeed(), {{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}}, {25.0})),
       {{"shape", "box"}, {"size_axis_mm", std::vector<double>{40, 20, 10}}, {"threshold_mm", 0.05}},
       toBox},
      {"ThresholdAtSeveralSpeeds",
       touching(oneSpeed(), oneSpeed().normals, {10.0, 30.0}),
       {{"shape", "sphere"}, {"threshold_mm", 0.05}},
       stay},
  };
}

class DelayOfFeature : public testing::TestWithParam<Arrangement> {};

INSTANTIATE_TEST_SUITE_P(Setups, DelayOfFeature, testing::ValuesIn(setups()),
                         [](const auto& setup) { return setup.param.name; });

Scene elsewhere(Scene scene, std::mt19937_64& random) {
  for (double& component : scene.centre_mm) component = uniform(random, -180.0, 180.0);
  scene.machine_delay_s = uniform(random, 0.001, 0.008);
  return scene;
}

TEST_P(DelayOfFeature, IsUnbiasedAndAsUncertainAsItSays) {
  std::mt19937_64 random{71};
  Moments tau;
  Moments size;
  for (int trial = 0; trial < kFeatureTrials; ++trial) {
    const Scene scene = elsewhere(GetParam().scene, random);
    const auto solved = solve(measure(GetParam(), scene, random));
    ASSERT_TRUE(solved.ok()) << solved.error().reason;
    tau.add(solved->find("tau_s")->value() - scene.tau(), *solved->find("tau_s")->standardDeviation());
    if (const auto* found = solved->find("size_mm")) size.add(found->value() - 31.0, *found->standardDeviation());
  }
  expectHonest(tau);
  EXPECT_THAT(tau.bias(), AllOf(Gt(-4.0), Lt(4.0)));
  if (size.count > 0) {
    expectHonest(size);
  }
}

TEST_P(DelayOfFeature, IsExactWithoutNoise) {
  std::mt19937_64 random{72};
  Scene scene = simulation::withoutNoise(elsewhere(GetParam().scene, random));
  scene.bounce_mm = 0.0;
  const auto solved = solve(measure(GetParam(), scene, random));
  ASSERT_TRUE(solved.ok()) << solved.error().reason;
  EXPECT_NEAR(solved->find("tau_s")->value(), scene.tau(), 1e-9);
  if (const auto* size = solved->find("size_mm")) {
    EXPECT_NEAR(size->value(), 31.0, 1e-7);
  }
}

// The same touches by the method that knows of spheres only: one gain for all is better, but the answer is the same.
TEST(DelayFeature, AgreesWithTheKnownSphere) {
  std::mt19937_64 random{73};
  Dataset dataset = measure(setups()[0], oneSpeed(), random);
  const auto feature = solve(dataset);
  dataset.method = "delay-known-sphere";
  dataset.config = {{"effective_diameter_mm", 31.0}};
  const auto sphere = solve(dataset);
  ASSERT_TRUE(feature.ok() && sphere.ok());
  EXPECT_NEAR(feature->find("tau_s")->value(), sphere->find("tau_s")->value(), 3.0 * feature->find("tau_s")->sd[0]);
}

// q = .05, D = 31: what is measured at the level is 30.900000; the delay does not depend on it.
TEST(DelayFeature, AThresholdGoesIntoTheSizeAndNotIntoTheDelay) {
  std::mt19937_64 random{74};
  Scene scene = simulation::withoutNoise(touching(oneSpeed(), oneSpeed().normals, {10.0, 20.0, 40.0}));
  scene.bounce_mm = 0.0;
  Dataset dataset = measure({"", scene, {{"shape", "sphere"}, {"threshold_mm", 0.05}}, stay}, scene, random);
  const auto solved = solve(dataset);
  ASSERT_TRUE(solved.ok()) << solved.error().reason;
  EXPECT_NEAR(solved->find("size_at_threshold_mm")->value(), 30.900000, 1e-7);
  EXPECT_NEAR(solved->find("tau_s")->value(), scene.tau(), 1e-9);
  // Nor at which level: it is looked for in the deflections that were recorded.
  dataset.config["size_mm"] = 31.0;
  for (const double level : {0.045, 0.05, 0.2}) {
    dataset.config["threshold_mm"] = level;
    EXPECT_NEAR(solve(dataset)->find("tau_s")->value(), scene.tau(), 1e-9) << level;
  }
  dataset.config["threshold_mm"] = 0.03;  // a sample at 40 mm/s goes further than that
  EXPECT_EQ(refusalOf(dataset), "bad-threshold");
}

// The article is driven too, along its own axis, with its own delay and on its own stamps.
struct Article {
  Vector3d velocity{12.0, -7.0, 5.0};
  double delay_s{0.004};
  double rate_hz{250.0};
};

Dataset onMovingArticle(const Scene& scene, const Article& moving, std::mt19937_64& random) {
  Dataset dataset = measure({"", scene, {{"shape", "sphere"}, {"size_mm", 31.0}}, stay}, scene, random);
  const Vector3d start{3.0, -2.0, 1.0};
  Table& machine = tableNamed(dataset, "machine");
  const auto signOf = [](double touch) { return static_cast<int>(touch) % 2 == 0 ? 1.0 : -1.0; };
  const auto articleAt = [&](double touch, double t) { return Vector3d{start + signOf(touch) * moving.velocity * t}; };
  std::map<double, double> ends;
  for (std::size_t row = 0; row < machine.columns[0].values.size(); ++row) {
    const double touch = machine.columns[0].values[row];
    const double stamp = machine.columns[1].values[row];
    const Vector3d by = articleAt(touch, stamp - scene.machine_delay_s);
    for (std::size_t k = 0; k < 3; ++k) machine.columns[2 + k].values[row] += by[static_cast<Eigen::Index>(k)];
    ends[touch] = stamp;
  }
  Table article = Table::withColumns("article", kMachineColumns);
  for (const auto& [touch, end] : ends) {
    for (double own = 0.0003; own < end + 1.0 / moving.rate_hz; own += 1.0 / moving.rate_hz) {
      const Vector3d at = articleAt(touch, own - moving.delay_s);
      const auto n = [&] { return gauss(random, scene.machine_sigma_mm); };
      article.append({touch, own, at.x() + n(), at.y() + n(), at.z() + n()});
    }
  }
  dataset.tables.push_back(article);
  return dataset;
}

TEST(DelayFeature, MayMoveTheArticle) {
  std::mt19937_64 random{75};
  Scene scene = simulation::withoutNoise(oneSpeed());
  scene.bounce_mm = 0.0;
  scene.normals.push_back({0, 0, -1});
  const auto solved = solve(onMovingArticle(scene, {.delay_s = scene.machine_delay_s}, random));
  ASSERT_TRUE(solved.ok()) << solved.error().reason;
  EXPECT_NEAR(solved->find("tau_s")->value(), scene.tau(), 1e-9);

  Dataset own = onMovingArticle(scene, {.delay_s = 0.009}, random);
  own.config["article_has_own_delay"] = true;
  const auto both = solve(own);
  ASSERT_TRUE(both.ok()) << both.error().reason;
  EXPECT_NEAR(both->find("tau_s")->value(), scene.tau(), 1e-9);
  EXPECT_NEAR(both->find("tau_article_s")->value(), 0.009 - scene.probe_delay_s, 1e-9);
}

// Error of a point along its motion against the sd that it states, for a delay that is known.
void addPulls(Moments& pulls, const SurfacePoints& touched, const Scene& scene, double threshold_mm) {
  for (const auto& point : touched.points) {
    const Vector3d velocity = point.probe_velocity - point.article_velocity;
    const Vector3d motion = velocity.normalized();
    const Vector3d truth =
        scene.centre_mm + scene.radius_mm * point.normal - threshold_mm * motion - scene.tau() * velocity;
    const double variance = point.of_mean + point.lever_s * (2.0 * point.of_both + point.lever_s * point.of_slope);
    pulls.add(motion.dot(point.machine - truth), std::sqrt(variance));
  }
}

TEST(SurfacePoints, AreAsUncertainAsTheySayAtAThreshold) {
  std::mt19937_64 random{79};
  for (const double dwell_s : {0.002, 0.02, 0.1}) {  // the rest of the record the stylus is free
    Scene scene = oneSpeed();
    scene.dwell_s = dwell_s;
    scene.gain << 1.1, 0.1, 0.0, -0.1, 0.9, 0.05, 0.0, 0.1, 1.2;
    Moments pulls;
    for (int round = 0; round < kRounds; ++round) {
      const auto points = surfacePoints(simulation::measure(scene, random), {0.1, scene.gain, 4});
      ASSERT_TRUE(points.ok()) << points.error().reason;
      addPulls(pulls, points.value(), scene, 0.1);
    }
    SCOPED_TRACE(testing::Message() << dwell_s);
    expectHonest(pulls);
  }
}

TEST(SurfacePoints, AreAsUncertainAsTheySayOnAMovingArticle) {
  std::mt19937_64 random{80};
  const Scene scene = oneSpeed();
  for (const double rate_hz : {1000.0, 500.0, 250.0, 100.0}) {
    Moments pulls;
    int refused = 0;
    for (int round = 0; round < kRounds; ++round) {
      const auto points = surfacePoints(onMovingArticle(scene, {.rate_hz = rate_hz}, random), {.unknowns = 4});
      if (points) addPulls(pulls, points.value(), scene, 0.0);
      refused += points ? 0 : 1;
    }
    EXPECT_LE(refused, kRounds / 20);
    SCOPED_TRACE(testing::Message() << rate_hz);
    expectHonest(pulls);
  }
}

// Four touches tell the four unknowns of a known sphere, and nothing would tell whether they agree.
TEST(DelayFeature, LeavesATouchOutOnlyAsLongAsTheOthersCheckEachOther) {
  std::mt19937_64 random{81};
  const auto withGap = [&](const Scene& scene) {
    Dataset dataset = measure({"", scene, {{"shape", "sphere"}, {"size_mm", 31.0}}, stay}, scene, random);
    Table& probe = tableNamed(dataset, "probe");
    const auto& touches = probe.columns[0].values;
    const auto last = static_cast<std::size_t>(std::ranges::upper_bound(touches, 1.0) - touches.begin());
    keepRows(probe, [&](std::size_t row) { return row >= last || row % 10 == 0 || touches[row] < 1.0; });
    return dataset;
  };
  Scene scene = oneSpeed();
  EXPECT_NE(refusalOf(withGap(scene)), "");
  scene.normals.push_back({0.6, 0.8, 0});
  const auto solved = solve(withGap(scene));
  ASSERT_TRUE(solved.ok()) << solved.error().reason;
  ASSERT_EQ(solved->dropped.size(), 1u);
  EXPECT_EQ(solved->dropped[0].name, "touch 1");
  EXPECT_TRUE(solved->chi2_reduced);
}

TEST(DelayFeature, GivesEachAxisItsOwnDelay) {
  std::mt19937_64 random{76};
  Scene scene = simulation::withoutNoise(simulation::perAxis());
  scene.bounce_mm = 0.0;
  const auto solved = solve(
      measure({"", scene, {{"shape", "sphere"}, {"size_mm", 31.0}, {"delays", "each-axis"}}, stay}, scene, random));
  ASSERT_TRUE(solved.ok()) << solved.error().reason;
  for (std::size_t k = 0; k < 3; ++k) {
    EXPECT_NEAR(solved->find("tau_axis_s")->values[k], scene.tauOf(static_cast<Eigen::Index>(k)), 1e-9);
  }
}

TEST(DelayFeature, IsRefusedByName) {
  std::mt19937_64 random{77};
  const auto refusal = [&](const Scene& scene, std::map<std::string, Value, std::less<>> config) {
    return refusalOf(measure({"", scene, std::move(config), stay}, scene, random));
  };
  const Scene sphere = oneSpeed();
  EXPECT_EQ(refusal(sphere, {}), "missing-key");
  EXPECT_EQ(refusal(sphere, {{"shape", "torus"}}), "bad-config");
  EXPECT_EQ(refusal(sphere, {{"shape", "sphere"}, {"size_mm", -31.0}}), "bad-config");
  EXPECT_EQ(refusal(sphere, {{"shape", "cylinder"}, {"size_mm", 31.0}}), "bad-config");
  EXPECT_EQ(refusal(sphere, {{"shape", "box"}}), "bad-config");
  EXPECT_EQ(refusal(sphere, {{"shape", "plane"}, {"size_mm", 31.0}}), "bad-config");
  EXPECT_EQ(refusal(sphere, {{"shape", "sphere"}, {"size_mm", 31.0}, {"delays", "some"}}), "bad-config");
  EXPECT_EQ(refusal(sphere, {{"shape", "sphere"}, {"size_mm", 31.0}, {"article_has_own_delay", true}}),
            "missing-table");
  EXPECT_EQ(refusal(sphere, {{"shape", "sphere"}}), "single-speed");
  EXPECT_EQ(refusal(sphere, {{"shape", "plane"}}), "not-on-feature");
  EXPECT_EQ(refusal(sphere, {{"shape", "cylinder"}, {"size_mm", 31.0}, {"axis_direction", kZ}}), "not-on-feature");
  EXPECT_EQ(refusal(touching(sphere, {{0, 0, 1}}, {20.0}), {{"shape", "plane"}}), "single-speed");
  EXPECT_EQ(refusal(touching(sphere, {{0, 0, 1}}, {20.0, 22.0}), {{"shape", "plane"}}), "speeds-too-close");
  EXPECT_EQ(refusal(touching(sphere, {{1, 0, 0}, {1, 0, 0}}, {20.0}), {{"shape", "plane-pair"}, {"size_mm", 31.0}}),
            "one-sided");
  EXPECT_EQ(refusal(touching(sphere, {{0, 0, 1}, {.1, 0, .995}, {0, .1, .995}, {-.1, 0, .995}, {0, -.1, .995}}, {20.0}),
                    {{"shape", "sphere"}, {"size_mm", 31.0}}),
            "one-sided");
  EXPECT_EQ(refusal(sphere, {{"shape", "sphere"}, {"size_mm", 31.0}, {"threshold_mm", 0.001}}), "bad-threshold");
  EXPECT_EQ(refusal(sphere, {{"shape", "sphere"}, {"size_mm", 31.0}, {"threshold_mm", 0.45}}), "bad-threshold");
  EXPECT_EQ(refusal(sphere, {{"shape", "sphere"}, {"size_mm", 31.0}, {"threshold_mm", -0.1}}), "bad-config");
}

TEST(DelayFeature, IsRefusedWhenATouchMissesIt) {
  std::mt19937_64 random{78};
  Scene scene = oneSpeed();
  scene.normals.push_back({0.6, 0.8, 0});
  Arrangement dirty{"", scene, {{"shape", "sphere"}, {"size_mm", 31.0}}, [](const Vector3d& normal) {
                      return Vector3d{(normal.x() == 0.6 ? 0.05 : 0.0) * normal};
                    }};
  EXPECT_EQ(refusalOf(measure(dirty, scene, random)), "residual-too-large");
}

}  // namespace
}  // namespace probebox::metrology
