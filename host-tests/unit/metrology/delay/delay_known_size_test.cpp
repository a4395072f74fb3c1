// The delay from touches of a feature whose size is known: sphere, plates, each axis, off the normal.
#include <Eigen/Dense>
#include <cmath>
#include <functional>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <string>

#include "firmware/metrology/solve.hpp"
#include "firmware/metrology/touch/retract.hpp"
#include "host-tests/metrology/moments.hpp"
#include "host-tests/metrology/touch_simulation.hpp"
#include "host-tests/support/sanitized.hpp"

namespace probebox::metrology {
namespace {

using simulation::measure;
using simulation::Scene;
using testing::AllOf;
using testing::Gt;
using testing::Lt;

constexpr int kSizeTrials = support::kSanitized ? 20 : 100;

struct SizeSetting {
  std::string name;
  Scene scene;
  // Against the reference precision, which is that of the ways out alone; two-sided.
  double least_efficiency{4.0};
  double greatest_efficiency{12.0};
};

// Names the setting in a message.
void PrintTo(const SizeSetting& setting, std::ostream* out) {
  *out << setting.name;
}

const Estimate& delayOf(const Result& result) {
  return result.estimates.front();
}

// By chance, or by a fifth: few samples tell noise and bounce badly.
void expectNearlyHonest(const Moments& errors) {
  const auto range = rangeOf({.dof = errors.count});
  EXPECT_GT(errors.pull(), std::min(range.low, 0.72));
  EXPECT_LT(errors.pull(), std::max(range.high, 1.44));
}

class DelayOfKnownSize : public testing::TestWithParam<SizeSetting> {};

TEST_P(DelayOfKnownSize, IsUnbiasedEfficientAndAsUncertainAsItSays) {
  std::mt19937_64 random{20260102};
  Moments tau;
  Moments centre;
  Moments gain;
  double reference_sd = 0.0;
  for (int trial = 0; trial < kSizeTrials; ++trial) {
    const Scene scene = simulation::shuffled(GetParam().scene, random);
    reference_sd = simulation::referencePrecision(scene).tau_sd_s;
    const auto solved = solve(measure(scene, random));
    ASSERT_TRUE(solved.ok()) << solved.error().reason;
    const Estimate& delay = delayOf(solved.value());
    for (std::size_t k = 0; k < delay.values.size(); ++k) {
      tau.add(delay.values[k] - scene.tauOf(static_cast<Eigen::Index>(k)), delay.sd[k]);
    }
    const Estimate* found = solved->find("centre_mm");
    for (std::size_t k = 0; found && k < 3; ++k) {
      centre.add(found->values[k] - scene.centre_mm[static_cast<Eigen::Index>(k)], found->sd[k]);
    }
    const Estimate* matrix = solved->find("gain_matrix");
    for (std::size_t k = 0; matrix && k < matrix->sd.size(); ++k) {
      gain.add(matrix->values[k] - scene.gain(static_cast<Eigen::Index>(k / 3), static_cast<Eigen::Index>(k % 3)),
               matrix->sd[k]);
    }
  }
  const double uncertainty = std::sqrt(2.0 / static_cast<double>(tau.count));
  EXPECT_THAT(reference_sd * reference_sd / tau.variance(),
              AllOf(Gt(GetParam().least_efficiency * (1.0 - uncertainty)),
                    Lt(GetParam().greatest_efficiency * (1.0 + 2.0 * uncertainty))));
  EXPECT_THAT(tau.bias(), AllOf(Gt(-4.0), Lt(4.0)));
  expectNearlyHonest(tau);
  if (centre.count > 0) {
    expectNearlyHonest(centre);
  }
  if (gain.count > 0) {
    expectNearlyHonest(gain);
  }
}

// Filters, time constants and vibration correlate neighbouring samples: a line through them averages less noise out.
TEST(DelayKnownSphere, IsAsUncertainAsItSaysWhereNeighbouringSamplesAreCorrelated) {
  std::mt19937_64 random{20260103};
  for (const double correlation : {0.3, 0.5, 0.7}) {
    SCOPED_TRACE(correlation);
    Moments tau;
    int warned = 0;
    for (int trial = 0; trial < 2 * kSizeTrials; ++trial) {
      Scene scene = simulation::shuffled(simulation::knownSphere(), random);
      scene.correlation = correlation;
      const auto solved = solve(measure(scene, random));
      // The noise of much correlated samples seems small beside the residuals, as after a slip.
      if (!solved.ok() && solved.error().name == "residual-too-large" && correlation > 0.5) continue;
      ASSERT_TRUE(solved.ok()) << solved.error().reason;
      tau.add(solved->find("tau_s")->value() - scene.tau(), solved->find("tau_s")->sd[0]);
      warned += testing::Matches(testing::Contains(testing::HasSubstr("are correlated")))(solved->warnings) ? 1 : 0;
    }
    EXPECT_THAT(tau.pull(), AllOf(Gt(0.7), Lt(1.35)));
    EXPECT_GT(tau.count, static_cast<std::size_t>(kSizeTrials));
    if (correlation >= 0.5) {
      EXPECT_GT(warned, static_cast<int>(tau.count * 9 / 10));
    }
  }
}

Scene with(Scene scene, const std::function<void(Scene&)>& change) {
  change(scene);
  return scene;
}
void noisy(Scene& scene) {
  scene.machine_sigma_mm *= 10.0;
  scene.probe_sigma_mm *= 10.0;
}
void noisier(Scene& scene) {
  scene.machine_sigma_mm *= 5.0;
  scene.probe_sigma_mm *= 5.0;
}
void fast(Scene& scene) {
  scene.machine_rate_hz = 1000.0;
  scene.probe_rate_hz = 4000.0;
}
void lossy(Scene& scene) {
  scene.lost_share = 0.05;
}
void gentle(Scene& scene) {
  scene.acceleration_mm_s2 = 5000.0;
  scene.dwell_s = 0.04;
}
void slow(Scene& scene) {
  scene.speeds_mm_s = {8.0};
}
void jittering(Scene& scene) {
  scene.stamp_jitter_s = 1e-5;
}
void jitteringMuch(Scene& scene) {
  scene.stamp_jitter_s = 1e-4;
}
// Stamps overtake each other now and then.
void jitteringPastEachOther(Scene& scene) {
  scene.stamp_jitter_s = 2e-4;
}
// Five samples of the probe from the ramp to the separation.
void sparse(Scene& scene) {
  scene.machine_rate_hz = scene.probe_rate_hz = 350.0;
}
void sparseAndSlow(Scene& scene) {
  scene.machine_rate_hz = scene.probe_rate_hz = 200.0;
  scene.speeds_mm_s = {10.0};
  scene.lost_share = 0.02;
}
// The ramp takes three fifths of the overtravel.
void heavy(Scene& scene) {
  scene.machine_rate_hz = scene.probe_rate_hz = 5000.0;
  scene.acceleration_mm_s2 = 2000.0;
  scene.speeds_mm_s = {35.0};
}
void steep(Scene& scene) {
  scene.approach_rad = 40.0 * M_PI / 180.0;
}
void block(Scene& scene) {
  scene.radius_mm = 21.0;
}
void ring(Scene& scene) {
  scene.radius_mm = -12.0;
}
void pin(Scene& scene) {
  scene.radius_mm = 9.0;
}

INSTANTIATE_TEST_SUITE_P(
    Settings, DelayOfKnownSize,
    testing::Values(SizeSetting{"Sphere", simulation::knownSphere()},
                    SizeSetting{"SphereNoisy", with(simulation::knownSphere(), noisy), 2.0},
                    SizeSetting{"SphereFast", with(simulation::knownSphere(), fast)},
                    SizeSetting{"SphereLossy", with(simulation::knownSphere(), lossy)},
                    SizeSetting{"SphereSlow", with(simulation::knownSphere(), slow)},
                    SizeSetting{"SphereJitter", with(simulation::knownSphere(), jittering)},
                    SizeSetting{"SphereJitterMuch", with(simulation::knownSphere(), jitteringMuch)},
                    SizeSetting{"SphereJitterPast", with(simulation::knownSphere(), jitteringPastEachOther), 2.0},
                    SizeSetting{"SphereSparse", with(simulation::knownSphere(), sparse)},
                    SizeSetting{"SphereSparseAndSlow", with(simulation::knownSphere(), sparseAndSlow)},
                    SizeSetting{"SphereHeavyMachine", with(simulation::knownSphere(), heavy)},
                    SizeSetting{"EachAxisSparse", with(simulation::perAxis(), sparse)},
                    SizeSetting{"OffTheNormalJitterMuch", with(simulation::nonNormal(), jitteringMuch)},
                    SizeSetting{"SphereFromWithin", with(simulation::knownSphere(), ring)},
                    SizeSetting{"Plates", simulation::plates()},
                    SizeSetting{"PlatesOfABlock", with(simulation::plates(), block)},
                    SizeSetting{"PlatesGentle", with(simulation::plates(), gentle)},
                    SizeSetting{"Bore", simulation::bore()}, SizeSetting{"Pin", with(simulation::bore(), pin)},
                    SizeSetting{"Cube", simulation::cube()}, SizeSetting{"EachAxis", simulation::perAxis()},
                    SizeSetting{"EachAxisNoisy", with(simulation::perAxis(), noisier), 3.0},
                    SizeSetting{"OffTheNormal", simulation::nonNormal()},
                    SizeSetting{"FarOffTheNormal", with(simulation::nonNormal(), steep)}),
    [](const auto& setting) { return setting.param.name; });

class KnownSizeMethod : public testing::TestWithParam<Scene> {};

INSTANTIATE_TEST_SUITE_P(Methods, KnownSizeMethod,
                         testing::Values(simulation::knownSphere(), simulation::plates(), simulation::perAxis(),
                                         simulation::nonNormal(), simulation::bore(), simulation::cube()),
                         [](const auto& scene) {
                           std::string name = scene.param.method;
                           std::erase(name, '-');
                           return name;
                         });

TEST_P(KnownSizeMethod, IsExactWithoutNoise) {
  std::mt19937_64 random{5};
  for (int trial = 0; trial < 20; ++trial) {
    Scene scene = simulation::shuffled(simulation::withoutNoise(GetParam()), random);
    scene.bounce_mm = 0.0;
    const auto solved = solve(measure(scene, random));
    ASSERT_TRUE(solved.ok()) << solved.error().reason;
    const Estimate& delay = delayOf(solved.value());
    for (std::size_t k = 0; k < delay.values.size(); ++k) {
      EXPECT_NEAR(delay.values[k], scene.tauOf(static_cast<Eigen::Index>(k)), 1e-11);
    }
  }
}

// Moving the machine changes nothing; nor does turning it, where the axes share one delay.
TEST_P(KnownSizeMethod, DoesNotDependOnWhereTheMachineStands) {
  std::mt19937_64 random{9};
  const Dataset dataset = measure(GetParam(), random);
  const Eigen::Matrix3d turn = GetParam().method == "delay-per-axis" || GetParam().method == "delay-cube"
                                   ? Eigen::Matrix3d::Identity()
                                   : Eigen::AngleAxisd{0.7, Eigen::Vector3d{1, 2, 3}.normalized()}.toRotationMatrix();
  const auto here = solve(dataset);
  const auto there = solve(simulation::moved(dataset, turn, {100, -50, 20}));
  ASSERT_TRUE(here.ok() && there.ok());
  for (std::size_t k = 0; k < delayOf(here.value()).values.size(); ++k) {
    EXPECT_NEAR(delayOf(here.value()).values[k], delayOf(there.value()).values[k], 1e-10);
    EXPECT_NEAR(delayOf(here.value()).sd[k], delayOf(there.value()).sd[k], 1e-10);
  }
}

// A delay known before and lost motion go into the answer one to one; a wrong size does not, and is told.
TEST_P(KnownSizeMethod, FollowsWhatItIsTold) {
  std::mt19937_64 random{10};
  Dataset dataset = measure(GetParam(), random);
  const auto before = solve(dataset);
  const bool each_axis = GetParam().method == "delay-per-axis";
  const std::string key = each_axis ? "previous_tau_axis_s" : "previous_tau_s";
  if (each_axis) {
    dataset.config[key] = std::vector<double>{0.003, 0.003, 0.003};
  } else {
    dataset.config[key] = 0.003;
  }
  const auto after = solve(dataset);
  ASSERT_TRUE(before.ok() && after.ok());
  EXPECT_NEAR(delayOf(after.value()).values[0], delayOf(before.value()).values[0] + 0.003, 1e-15);
  EXPECT_NEAR(after->find("residual_" + delayOf(after.value()).key)->values[0], delayOf(before.value()).values[0],
              1e-15);

  // Of a cube each edge grows with the ball.
  const bool has_ball = dataset.config.contains("stylus_ball_diameter_mm");
  const std::string size = has_ball ? "stylus_ball_diameter_mm" : "effective_diameter_mm";
  const double inside = has_ball && GetParam().extent_mm({1, 0, 0}) < 0 ? -1 : 1;
  const double larger = std::get<double>(dataset.config[size]) + 0.002 * inside;
  dataset.config[size] = larger;
  const auto larger_stated = solve(dataset);
  ASSERT_TRUE(larger_stated) << larger_stated.error().reason;
  EXPECT_NEAR(delayOf(*larger_stated).values[0], delayOf(*after).values[0], 1e-9);
  const Estimate& error = *larger_stated->find("static_error_mm");
  EXPECT_NEAR(error.value(), after->find("static_error_mm")->value() - 0.002, 1e-9);
  EXPECT_NEAR(error.value(), -0.002, 5.0 * error.sd[0]);

  // 1 um along the drive is 1 um / 2 S; a drive off the axes loses more.
  dataset.config["lost_motion_mm"] = 0.001;
  const double per_drive = delayOf(*solve(dataset)).values[0] - delayOf(*after).values[0];
  EXPECT_GE(per_drive, 0.999 * 0.001 / 50.0);
  EXPECT_LE(per_drive, GetParam().approach_rad > 0.0 ? 1.75 * 0.001 / 50.0 : 1.001 * 0.001 / 50.0);
}

// The same physics by another way: every touch by its own slopes to one point, then dense normal equations of
// |M + tau v - c|^2 = R^2, linearised about the point itself, solved by elimination until nothing moves.
double independentDelay(const Dataset& dataset, double radius) {
  const auto touches = readTouches(dataset);
  std::vector<Eigen::Vector3d> points;
  std::vector<Eigen::Vector3d> velocities;
  for (const auto& touch : touches.value()) {
    const auto retract = fitRetract(touch, {});
    points.push_back(separationPoint(retract->machine, retract->probe));
    velocities.push_back(retract->machine.slope);
  }
  Eigen::Vector4d at = Eigen::Vector4d::Zero();
  for (const auto& p : points) at.head<3>() += p / static_cast<double>(points.size());
  for (int step = 0; step < 200; ++step) {
    Eigen::Matrix4d normal = Eigen::Matrix4d::Zero();
    Eigen::Vector4d right = Eigen::Vector4d::Zero();
    for (std::size_t i = 0; i < points.size(); ++i) {
      const Eigen::Vector3d arm = points[i] + at[3] * velocities[i] - at.head<3>();
      Eigen::Vector4d row;
      row << -2.0 * arm, 2.0 * arm.dot(velocities[i]);
      normal += row * row.transpose();
      right -= row * (arm.squaredNorm() - radius * radius);
    }
    at += normal.fullPivLu().solve(right);
  }
  return at[3];
}

TEST(DelayKnownSphere, AgreesWithDenseNormalEquations) {
  std::mt19937_64 random{12};
  for (const Scene& start : {simulation::knownSphere(), simulation::nonNormal()}) {
    Scene scene = simulation::shuffled(simulation::withoutNoise(start), random);
    scene.bounce_mm = 0.0;
    const Dataset exact = measure(scene, random);
    EXPECT_NEAR(delayOf(solve(exact).value()).value(), independentDelay(exact, scene.radius_mm), 2e-7);
    const Dataset noisy = measure(simulation::shuffled(start, random), random);
    const auto solved = solve(noisy);
    // By the ways out alone, which tell it half as well.
    EXPECT_NEAR(delayOf(solved.value()).value(), independentDelay(noisy, start.radius_mm),
                4.0 * 2.5 * delayOf(solved.value()).sd[0]);
  }
}

// Channel c of a probe is no temperature, whatever it counts to.
TEST(DelayKnownSphere, IsTheSameForAProbeThatCounts) {
  std::mt19937_64 random{20261126};
  Dataset dataset = measure(simulation::knownSphere(), random);
  const auto in_mm = solve(dataset);
  for (auto& table : dataset.tables) {
    for (auto& column : table.columns) {
      if (column.name != "a" && column.name != "b" && column.name != "c") continue;
      for (double& value : column.values) value *= 1e5;
    }
  }
  const auto in_counts = solve(dataset);
  ASSERT_TRUE(in_mm && in_counts) << in_counts.error().reason;
  EXPECT_NEAR(delayOf(*in_counts).value(), delayOf(*in_mm).value(), 1e-3 * delayOf(*in_mm).sd[0]);
}

TEST(DelayOfKnownSizeIsRefused, WhenTheConfigurationDoesNotFit) {
  std::mt19937_64 random{13};
  const auto refusal = [](const Dataset& dataset) { return solve(dataset).error().name; };
  Dataset sphere = measure(simulation::knownSphere(), random);
  Dataset gap = measure(simulation::plates(), random);
  Dataset axes = measure(simulation::perAxis(), random);
  for (const auto* word : {"sideways", "internal"}) {
    sphere.config["feature"] = std::string{word};
    EXPECT_EQ(refusal(sphere), "bad-config") << word;
  }
  sphere.config.erase("feature");
  sphere.config.erase("effective_diameter_mm");
  EXPECT_EQ(refusal(sphere), "missing-key");
  gap.config["gap_mm"] = 5.0;
  EXPECT_EQ(refusal(gap), "bad-config");
  gap.config.erase("gap_mm");
  EXPECT_EQ(refusal(gap), "missing-key");
  axes.config["previous_tau_axis_s"] = 0.003;
  EXPECT_EQ(refusal(axes), "bad-config");
  axes.config.erase("previous_tau_axis_s");
  axes.config.erase("effective_diameter_mm");
  EXPECT_EQ(refusal(axes), "single-speed");
}

// The faces are planes, so it does not matter where each is touched.
TEST(DelayCube, KnowsItsSizeFromTouchesBesideTheMiddlesOfItsFaces) {
  std::mt19937_64 random{16};
  Scene scene = simulation::withoutNoise(simulation::cube());
  scene.bounce_mm = 0.0;
  scene.speeds_mm_s = {8.0, 25.0};
  const auto solved = solve(measure(scene, random));
  ASSERT_TRUE(solved.ok()) << solved.error().reason;
  EXPECT_NEAR(solved->find("static_error_mm")->value(), 0.0, 1e-6);
  EXPECT_NEAR(solved->find("tau_s")->value(), scene.tau(), 1e-9);
}

TEST(DelayOfKnownSizeIsRefused, WhenACylinderOrACubeHasNoSuchSide) {
  std::mt19937_64 random{15};
  const auto refusal = [&](Scene scene, std::vector<Eigen::Vector3d> normals) {
    scene.normals = std::move(normals);
    return solve(measure(scene, random)).error().name;
  };
  EXPECT_EQ(refusal(simulation::bore(), simulation::knownSphere().normals), "not-on-feature");
  EXPECT_EQ(refusal(simulation::bore(), {{1, 0, 0}, {-1, 0, 0}, {1, 0, 0}}), "one-sided");
  EXPECT_EQ(refusal(simulation::cube(), {{1, 0, 0}, {-1, 0, 0}, {0, .6, .8}, {0, -1, 0}, {0, 0, 1}}), "not-on-feature");
  Dataset cube = measure(simulation::cube(), random);
  cube.config["edges_mm"] = std::vector<double>{20, 0, 20};
  EXPECT_EQ(solve(cube).error().name, "bad-config");
  Dataset bore = measure(simulation::bore(), random);
  bore.config["feature"] = std::string{"external"};
  EXPECT_EQ(solve(bore).error().name, "bad-config") << "the normals point inwards";
  bore.config.erase("feature");
  bore.config["diameter_mm"] = 5.0;
  EXPECT_EQ(solve(bore).error().name, "bad-config");
}

TEST(DelayOfKnownSizeIsRefused, WhenTheSidesDoNotSuffice) {
  std::mt19937_64 random{14};
  const auto refusal = [&](Scene scene, std::vector<Eigen::Vector3d> normals) {
    scene.normals = std::move(normals);
    const auto solved = solve(measure(scene, random));
    return solved.ok() ? "solved" : solved.error().name;
  };
  EXPECT_EQ(refusal(simulation::perAxis(), {{1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}, {0, 0, 1}}),
            "one-sided");
  EXPECT_EQ(
      refusal(simulation::knownSphere(), {{0, 0, 1}, {.1, 0, .995}, {0, .1, .995}, {-.1, 0, .995}, {0, -.1, .995}}),
      "one-sided");
  EXPECT_EQ(refusal(simulation::knownSphere(), {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}), "too-few-readings");
  EXPECT_EQ(refusal(simulation::plates(), {{1, 0, 0}, {0, 1, 0}}), "not-opposed");
  EXPECT_EQ(refusal(simulation::plates(), {{1, 0, 0}, {1, 0, 0}}), "one-sided");
  Scene grazing = simulation::nonNormal();
  grazing.approach_rad = 62.0 * M_PI / 180.0;
  EXPECT_EQ(solve(measure(grazing, random)).error().name, "bad-direction");
}

// Ten samples of a retract tell their noise badly: what scatters more there than at rest is no slip yet.
TEST(StampsThatJitter, SeldomSpoilATouch) {
  std::mt19937_64 random{51};
  int refused = 0;
  Moments tau;
  for (int trial = 0; trial < 300; ++trial) {
    Scene scene = simulation::shuffled(simulation::knownSphere(), random);
    scene.stamp_jitter_s = 5e-5;
    const auto solved = solve(measure(scene, random));
    if (!solved.ok()) {
      ++refused;
      continue;
    }
    tau.add(solved->find("tau_s")->value() - scene.tau(), *solved->find("tau_s")->standardDeviation());
  }
  EXPECT_LE(refused, 5);
  expectHonest(tau);
}

// Two speeds tell delay, size and lost motion apart: what is wrong with sphere or machine is not blamed on touches.
TEST(DelayOfKnownSize, AtTwoSpeedsDependsNeitherOnAWrongSizeNorOnLostMotion) {
  std::mt19937_64 random{97};
  for (Scene scene : {simulation::knownSphere(), simulation::plates(), simulation::perAxis()}) {
    SCOPED_TRACE(scene.method);
    scene.speeds_mm_s = {8.0, 25.0};
    scene.errors.lost_motion_mm.setConstant(0.005);
    Dataset dataset = simulation::measure(scene, random);
    const bool plates = scene.method == "delay-plates";
    double& size = std::get<double>(dataset.config[plates ? "gap_mm" : "effective_diameter_mm"]);
    size += 0.02;
    dataset.config[plates ? "sd_gap_mm" : "sd_effective_diameter_mm"] = 0.0005;
    const auto solved = solve(dataset);
    ASSERT_TRUE(solved.ok()) << solved.error().reason;
    EXPECT_TRUE(std::ranges::all_of(solved->dropped, [](const auto& one) { return one.reason == "spike"; }));
    EXPECT_TRUE(std::ranges::any_of(solved->warnings, [](const auto& w) { return w.starts_with("static-error"); }));
    const Estimate& tau = *solved->find(scene.method == "delay-per-axis" ? "tau_axis_s" : "tau_s");
    for (std::size_t k = 0; k < tau.values.size(); ++k)
      EXPECT_NEAR(tau.values[k], scene.tauOf(static_cast<Eigen::Index>(k)), 4.0 * tau.sd[k]);
    EXPECT_NEAR(solved->find("static_error_mm")->value(), -0.02, 0.001);
  }
}

}  // namespace
}  // namespace probebox::metrology
