// What a check says of a machine, against what the simulated machine errs by.
#include "firmware/metrology/machine/machine_check.hpp"

#include <cmath>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <map>
#include <string>

#include "host-tests/metrology/cases.hpp"
#include "host-tests/metrology/moments.hpp"
#include "host-tests/metrology/touch_simulation.hpp"
#include "host-tests/support/runs.hpp"

namespace probebox::metrology {
namespace {

using Eigen::Vector3d;
using simulation::MachineErrors;
using simulation::Scene;

// Amplitudes of the cosine of two and three lobes, and of the sine of four.
constexpr double kTwo_mm = 0.001, kThree_mm = 0.003, kFour_mm = -0.0005;

MachineErrors worn() {
  MachineErrors errors;
  errors.lost_motion_mm = {0.005, 0.004, 0.006};
  errors.drift_mm_min = {0.0005, -0.0004, 0.0006};
  errors.hysteresis_mm = 0.001;
  errors.zero_drift_mm_min = {0.0001, 0, -0.0001};
  errors.curvature_per_mm = {0.01, 0.01, 0.008};
  errors.form_mm = [](const Vector3d& n) {
    const double across = std::hypot(n.x(), n.y()), around = std::atan2(n.y(), n.x());
    return across *
           (kTwo_mm * std::cos(2 * around) + kThree_mm * std::cos(3 * around) + kFour_mm * std::sin(4 * around));
  };
  return errors;
}

MachineErrors scattered() {
  MachineErrors errors = worn();
  errors.scatter_mm = 0.001;
  return errors;
}

struct World {
  std::string name;
  MachineErrors errors;
};
void PrintTo(const World& world, std::ostream* out) {
  *out << world.name;
}

Dataset checked(const Scene& scene, std::mt19937_64& random) {
  auto dataset = simulation::measure(scene, random);
  dataset.config["effective_diameter_mm"] = 2 * scene.radius_mm;
  return dataset;
}

// In the order of their components.
std::map<std::string, std::vector<double>> truthOf(const Scene& scene) {
  const MachineErrors& errors = scene.errors;
  const auto list = [](const Vector3d& v) { return std::vector<double>{v.x(), v.y(), v.z()}; };
  const bool lobes = static_cast<bool>(errors.form_mm);
  const double rest = scene.machine_sigma_mm;
  std::vector<double> free;
  for (Eigen::Index axis = 0; axis < 3; ++axis) free.push_back(scene.probe_sigma_mm * scene.gain.row(axis).norm());
  return {{"lost_motion_mm", list(errors.lost_motion_mm.array() + errors.hysteresis_mm)},
          {"probe_hysteresis_mm", {errors.hysteresis_mm}},
          {"lobing_mm", {lobes ? kTwo_mm : 0, 0, lobes ? kThree_mm : 0, 0, 0, lobes ? kFour_mm : 0, 0}},
          {"gain_curvature_per_mm", list(errors.curvature_per_mm)},
          {"machine_drift_um_per_min", list(1e3 * errors.drift_mm_min)},
          {"zero_drift_um_per_min", list(1e3 * errors.zero_drift_mm_min)},
          {"noise_machine_mm", {rest, rest, rest}},
          {"noise_probe_mm", free},
          {"static_error_mm", {0}},
          {"tau_axis_s", {scene.tau(), scene.tau(), scene.tau()}}};
}

class MachineCheckOf : public testing::TestWithParam<World> {};

TEST_P(MachineCheckOf, FindsWhatTheMachineErrsByAsWellAsItStates) {
  std::map<std::string, Moments> pulls;
  std::map<std::string, double> sums, squares;
  const auto count = runs(32);
  for (std::uint64_t seed = 1; seed <= count; ++seed) {
    std::mt19937_64 random{seed};
    Scene scene = simulation::shuffled(simulation::machineCheck(), random);
    scene.errors = GetParam().errors;
    const auto result = solve(checked(scene, random));
    ASSERT_TRUE(result) << result.error().reason;
    for (const auto& [key, truth] : truthOf(scene)) {
      const auto* found = result->find(key);
      ASSERT_NE(found, nullptr) << key;
      ASSERT_EQ(found->values.size(), truth.size()) << key;
      for (std::size_t k = 0; k < truth.size(); ++k) {
        pulls[key].add(found->values[k] - truth[k], found->sd[k]);
        EXPECT_LT(std::abs(found->values[k] - truth[k]), 5 * found->sd[k]) << key << " " << k << ", seed " << seed;
      }
    }
    // Of these the truth is what many runs find.
    for (const auto* key : {"form_3d_mm", "form_2d_mm", "touch_scatter_in_mm", "touch_scatter_out_mm"}) {
      const auto* found = result->find(key);
      ASSERT_NE(found, nullptr) << key;
      sums[key] += found->value();
      squares[key] += found->value() * found->value();
      sums[std::string{key} + ", sd"] += found->sd.front();
    }
  }
  for (const auto& [key, moments] : pulls) {
    SCOPED_TRACE(key);
    // Components of one run share its noise.
    expectHonest(moments, count);
  }
  const auto n = static_cast<double>(count);
  for (const auto& [key, sum] : squares) {
    const double mean = sums[key] / n, scatter = std::sqrt((sum / n - mean * mean) * n / (n - 1));
    EXPECT_THAT(scatter / (sums[key + ", sd"] / n), testing::AllOf(testing::Gt(0.4), testing::Lt(1.6))) << key;
    if (key.starts_with("touch_scatter")) {
      EXPECT_NEAR(mean, std::hypot(GetParam().errors.scatter_mm, 0.00027), 1e-4) << key;
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Machines, MachineCheckOf,
                         testing::Values(World{"Sound", {}}, World{"Worn", worn()}, World{"Scattered", scattered()}),
                         [](const auto& world) { return world.param.name; });

// Bi-directional repeatability by its definition, and the range of the form that was put in.
TEST(MachineCheck, SpeaksInTheTermsOfTheStandards) {
  std::mt19937_64 random{5};
  Scene scene = simulation::machineCheck();
  scene.errors = scattered();
  const auto result = solve(checked(scene, random));
  ASSERT_TRUE(result) << result.error().reason;
  const double in = result->find("touch_scatter_in_mm")->value(), out = result->find("touch_scatter_out_mm")->value();
  for (std::size_t axis = 0; axis < 3; ++axis) {
    EXPECT_NEAR(result->find("repeatability_mm")->values[axis],
                2 * in + 2 * out + result->find("lost_motion_mm")->values[axis], 1e-9);
  }
  scene.errors = worn();
  const auto sharp = solve(checked(scene, random));
  ASSERT_TRUE(sharp) << sharp.error().reason;
  EXPECT_NEAR(sharp->find("form_2d_mm")->value(), 0.0074, 0.001);
  EXPECT_NEAR(sharp->find("form_3d_mm")->value(), 0.0078, 0.001);
  EXPECT_THAT(sharp->warnings, testing::Not(testing::Contains(testing::StartsWith("form-not-of-lobes"))));
}

TEST(MachineCheck, FindsLinesInTheNoiseAndTheirAliases) {
  std::mt19937_64 random{6};
  Scene scene = simulation::machineCheck();
  scene.errors.axes_hz = 460;  // at 500 samples/s
  scene.errors.axes_amplitude_mm = {0.0003, 0.0004, 0};
  scene.errors.probe_hz = 180;
  scene.errors.probe_amplitude_mm = {0.0003, 0, 0};
  const auto result = solve(checked(scene, random));
  ASSERT_TRUE(result) << result.error().reason;
  const auto near = [&](const char* key, double truth) {
    const auto* found = result->find(key);
    ASSERT_NE(found, nullptr) << key;
    EXPECT_NEAR(found->value(), truth, 4 * found->sd.front()) << key;
  };
  near("line_machine_hz", 40);
  near("line_machine_mm", 0.0005);
  near("line_free_hz", 180);
  near("line_free_mm", 0.0003);
  near("line_contact_mm", 0.0005);  // of the body
  EXPECT_THAT(result->unobservable, testing::Contains(testing::HasSubstr("460")));
}

TEST(MachineCheck, FindsNoLineInWhiteNoise) {
  for (std::uint64_t seed = 1; seed <= 8; ++seed) {
    std::mt19937_64 random{seed};
    const auto result = solve(checked(simulation::machineCheck(), random));
    ASSERT_TRUE(result) << result.error().reason;
    for (const auto* key : {"line_machine_mm", "line_contact_mm", "line_free_mm"})
      EXPECT_EQ(result->find(key), nullptr) << key << ", seed " << seed;
    EXPECT_THAT(result->warnings, testing::IsEmpty()) << "seed " << seed;
  }
}

TEST(MachineCheck, RefusesARunThatCannotTell) {
  std::mt19937_64 random{7};
  const Scene whole = simulation::machineCheck();
  const auto without = [&](const auto& which) {
    Scene scene = whole;
    std::erase_if(scene.visits, which);
    return refusalOf(checked(scene, random));
  };
  EXPECT_EQ(without([](const auto& visit) { return visit.speed_mm_s > 20; }), "single-speed");
  EXPECT_EQ(without([](const auto& visit) { return visit.normal.cwiseAbs().maxCoeff() < 0.99; }), "few-directions");
  EXPECT_EQ(without([](const auto& visit) { return visit.normal.x() > 0.3 && visit.normal.x() < 0.99; }),
            "few-directions");
  Scene open = whole;
  open.visits.resize(open.visits.size() - 10);
  std::erase_if(open.visits, [n = 0](const auto&) mutable { return n++ >= 36 && n <= 46; });
  EXPECT_EQ(refusalOf(checked(open, random)), "not-closed");
  auto turned = checked(whole, random);
  turned.config["A_rad"] = 0.5;
  EXPECT_EQ(refusalOf(turned), "spindle-turned");
}

}  // namespace
}  // namespace probebox::metrology
