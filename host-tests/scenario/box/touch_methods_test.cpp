#include <algorithm>
#include <cmath>
#include <gtest/gtest.h>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "firmware/metrology/dataset/read_times.hpp"
#include "firmware/metrology/methods.hpp"
#include "firmware/procedure/methods/methods.hpp"
#include "firmware/procedure/plan/sides.hpp"
#include "host-tests/emulation/scenario.hpp"
#include "host-tests/support/runs.hpp"
#include "pulls.hpp"

// Every touch method for the delay, run on the emulated machine: its controller drives where the box prompts.
namespace probebox::scenario {
namespace {

using namespace std::chrono_literals;
using procedure::LiveMethod;

const std::uint64_t kTouchSeeds = runs(40);

// A machine whose delay differs from seed to seed; with `each_axis` also from axis to axis.
world::Config touchWorld(std::uint64_t seed, bool each_axis) {
  world::Config config = usualWorld();
  const double tau_s = 0.002 + 0.0001 * static_cast<double>(seed);
  config.delays.tau_machine_s = {tau_s, tau_s, tau_s};
  if (each_axis) config.delays.tau_machine_s = {tau_s, tau_s + 0.0007, tau_s - 0.0004};
  return config;
}

// The machine does all steps of the method, each once, without touching anything else.
std::optional<metrology::Result> run(Scenario& scenario, const procedure::LiveMethod& method,
                                     const ProcedureOptions& options = {}) {
  scenario.recorder().keeps_bytes = false;
  scenario.run(2s);
  const auto solved = scenario.calibrate(method, options);
  const auto& progress = scenario.state().procedure;
  if (!solved) {
    ADD_FAILURE() << method.name() << " stopped in step " << progress.step;
    return std::nullopt;
  }
  EXPECT_EQ(scenario.machine().stylus().contactCount(), progress.steps);
  EXPECT_EQ(scenario.machine().crashes(), 0U);
  EXPECT_EQ(scenario.controller().abandonedSteps(), 0U);
  if (!solved->ok()) {
    ADD_FAILURE() << method.name() << ": " << solved->error().reason;
    return std::nullopt;
  }
  return solved->value();
}

// bounce_mm: of the stylus at contact, where it is not the usual one.
void expectHonest(const procedure::LiveMethod& method, std::optional<double> bounce_mm = {}) {
  const bool each_axis = &method == &procedure::kDelayPerAxis;
  Pulls pulls;
  for (std::uint64_t seed = 1; seed <= kTouchSeeds; ++seed) {
    world::Config config = touchWorld(seed, each_axis);
    if (bounce_mm) config.probe.bounce_mm = *bounce_mm;
    Scenario scenario{config, seed};
    const auto result = run(scenario, method);
    ASSERT_TRUE(result);
    const auto* tau = result->find(each_axis ? "tau_axis_s" : "tau_s");
    ASSERT_NE(tau, nullptr);
    for (std::size_t i = 0; i < tau->values.size(); ++i) {
      // Of drives on one side two speeds take more than half of what they tell.
      EXPECT_LT(tau->sd[i], &method == &procedure::kDelayInOut ? 6e-5 : 3e-5);
      pulls.add(tau->values[i], scenario.truth().tau_s[i], tau->sd[i]);
    }
  }
  pulls.expectHonest();
}

TEST(LiveKnownSphere, FindsTheDelayWithTheUncertaintyThatItStates) {
  expectHonest(procedure::kDelayKnownSphere);
}
TEST(LivePlates, FindsTheDelayWithTheUncertaintyThatItStates) {
  expectHonest(procedure::kDelayPlates);
}
TEST(LiveCylinder, FindsTheDelayInABoreWithTheUncertaintyThatItStates) {
  expectHonest(procedure::kDelayCylinder);
}
TEST(LiveCube, FindsTheDelayWithTheUncertaintyThatItStates) {
  expectHonest(procedure::kDelayCube);
}

// Axes with delays of their own: each pair of plates tells that of the axis across which it stands, and its result is
// in force for that one alone.
TEST(LivePlates, TellTheDelayOfTheAxisAcrossWhichTheyStandAndOfNoOther) {
  for (std::uint8_t axis = 0; axis < 3; ++axis) {
    Pulls pulls;
    for (std::uint64_t seed = 1; seed <= runs(12); ++seed) {
      Scenario scenario{touchWorld(seed, true), seed};
      ProcedureOptions options{.axis = static_cast<std::uint8_t>(axis + 1)};
      options.faces = procedure::facesAcross(axis);
      const auto result = run(scenario, procedure::kDelayPlates, options);
      ASSERT_TRUE(result);
      const auto* tau = result->find("tau_s");
      EXPECT_LT(tau->sd[0], 3e-5);
      pulls.add(tau->value(), scenario.truth().tau_s[axis], tau->sd[0]);
      EXPECT_EQ(metrology::subjectOf(scenario.dataset()), std::string{"delay-"} + "xyz"[axis]);
    }
    pulls.expectHonest();
  }
}

// A pin in place of the bore, which is as large.
TEST(LiveCylinder, FindsTheDelayAtAPin) {
  world::Config config = touchWorld(3, false);
  config.cylinder->wall_mm = 0;
  Scenario scenario{config, 3};
  scenario.facts.datum_cylinder->inside = false;
  const auto result = run(scenario, procedure::kDelayCylinder);
  ASSERT_TRUE(result);
  const auto* tau = result->find("tau_s");
  EXPECT_NEAR(tau->value(), scenario.truth().tau_s[0], 4 * tau->sd[0]);
  EXPECT_EQ(metrology::subjectOf(scenario.dataset()), "delay-xy");
}

TEST(LivePerAxis, FindsTheDelayOfEachAxisWithTheUncertaintyThatItStates) {
  expectHonest(procedure::kDelayPerAxis);
}
TEST(LiveNonNormal, FindsTheDelayWithTheUncertaintyThatItStates) {
  expectHonest(procedure::kDelayNonNormal);
}
TEST(LiveInOut, FindsTheDelayWithTheUncertaintyThatItStates) {
  expectHonest(procedure::kDelayInOut, 0);
}
// The probe alone feels a bounce: the time right after contact is left out.
TEST(LiveInOut, FindsTheDelayWhenTheStylusBounces) {
  expectHonest(procedure::kDelayInOut);
}

// A probe that does not touch looks down on the sphere, beside whose top it comes: along Z that does not matter.
TEST(LiveDistances, TellTheDelayOfZWithTheUncertaintyThatTheyState) {
  Pulls pulls;
  for (std::uint64_t seed = 1; seed <= kTouchSeeds; ++seed) {
    world::Config config = touchWorld(seed, true);
    config.distance_probe = board::ProbeDistance{.stand_off_mm = 20, .range_mm = 2};
    config.sphere.stylus_ball_radius_mm = 0;
    Scenario scenario{config, seed};
    scenario.facts.distance_probe = procedure::DistanceProbe{.stand_off_mm = 20, .range_mm = 2};
    scenario.facts.stylus_ball_diameter_mm = 0;
    scenario.recorder().keeps_bytes = false;
    scenario.run(2s);
    const auto solved = scenario.calibrate(procedure::kDelayInOut);
    ASSERT_TRUE(solved) << "stopped in step " << scenario.state().procedure.step;
    ASSERT_TRUE(solved->ok()) << solved->error().reason;
    EXPECT_EQ(scenario.machine().stylus().contactCount(), 0U);
    EXPECT_EQ(scenario.machine().crashes(), 0U);
    EXPECT_EQ(metrology::subjectOf(scenario.dataset()), "delay-z");
    const auto* tau = solved->value().find("tau_s");
    EXPECT_LT(tau->sd[0], 6e-5);
    pulls.add(tau->value(), scenario.truth().tau_s[2], tau->sd[0]);
  }
  pulls.expectHonest();
}

TEST(LiveInOut, GoesInAndAtOnceBackOut) {
  Scenario scenario{usualWorld(), 2};
  scenario.recorder().keeps_bytes = false;
  scenario.run(2s);
  scenario.calibrate(procedure::kDelayInOut);
  EXPECT_EQ(scenario.machine().stylus().contactCount(), 3U);
  const auto* probe = scenario.dataset().table("probe");
  ASSERT_NE(probe, nullptr);
  const auto& depth = *probe->column("a");
  const double deepest = *std::ranges::max_element(depth);
  EXPECT_NEAR(deepest, 0.5, 0.2);
  std::size_t touching = 0, flat = 0;
  for (const double a : depth) {
    touching += std::abs(a) > 0.05 * deepest ? 1U : 0U;
    flat += std::abs(a) > 0.95 * deepest ? 1U : 0U;
  }
  EXPECT_GT(touching, 30U);
  EXPECT_LT(static_cast<double>(flat), 0.2 * static_cast<double>(touching)) << "a dwell would hide the apex";
}

// The swivelling head stands where it began, off by its stop, which moves all touches of a run alike.
TEST(LiveKnownSphere, FindsThePlaceOfTheSphereAsWellAsItSays) {
  Pulls across, along;
  for (std::uint64_t seed = 1; seed <= runs(24); ++seed) {
    const auto config = usualWorld();
    Scenario scenario{config, seed};
    scenario.recorder().keeps_bytes = false;
    scenario.run(2s);
    const auto solved = scenario.calibrate(procedure::kDelayKnownSphere);
    ASSERT_TRUE(solved && solved->ok());
    const auto& centre = *solved->value().find("centre_mm");
    for (std::size_t k = 0; k < 3; ++k) {
      const double truth = config.sphere.centre_mm[k] - (k < 2 ? config.probe_spindle.stylus_offset_mm[k] : 0);
      (k == 0 ? across : along).add(centre.values[k], truth, centre.sd[k]);
    }
  }
  across.expectHonest();
  along.expectHonest();
}

TEST(LiveCases, HaveTheTablesAndKeysOfTheirMethods) {
  const std::vector<std::pair<const LiveMethod*, std::vector<std::string>>> cases{
      {&procedure::kDelayKnownSphere, {"A_rad", "B_rad", "effective_diameter_mm", "feature", "stylus_ball"}},
      {&procedure::kDelayPlates, {"A_rad", "B_rad", "feature", "gap_mm", "stylus_ball", "stylus_ball_diameter_mm"}},
      {&procedure::kDelayCylinder,
       {"A_rad", "B_rad", "diameter_mm", "feature", "stylus_ball", "stylus_ball_diameter_mm"}},
      {&procedure::kDelayCube, {"A_rad", "B_rad", "edges_mm", "stylus_ball", "stylus_ball_diameter_mm"}},
      {&procedure::kDelayNonNormal, {"A_rad", "B_rad", "effective_diameter_mm", "stylus_ball"}},
      {&procedure::kDelayInOut, {"A_rad", "B_rad"}},
  };
  for (const auto& [method, keys] : cases) {
    Scenario scenario{usualWorld(), 2};
    scenario.recorder().keeps_bytes = false;
    scenario.run(2s);
    scenario.calibrate(*method);
    const auto& dataset = scenario.dataset();
    EXPECT_EQ(dataset.method, method->name());
    std::vector<std::string> found;
    for (const auto& [key, value] : dataset.config) {
      if (!isMachineError(key) && key != metrology::kReadingTime) found.push_back(key);
    }
    EXPECT_EQ(found, keys) << dataset.method;
    EXPECT_EQ(dataset.config.size(), keys.size() + std::size(kMachineErrors) + 1)
        << "and what is known of the machine's own errors, with the time that counts for a drift";
    const bool tells_where = method == &procedure::kDelayKnownSphere;
    ASSERT_EQ(dataset.tables.size(), tells_where ? 4U : 3U)
        << "with what the stop of the head moves the sphere's place by";
    EXPECT_EQ(dataset.tables[2].rows(), scenario.state().procedure.steps);
  }
}

}  // namespace
}  // namespace probebox::scenario
