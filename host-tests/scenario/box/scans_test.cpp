#include <algorithm>
#include <cmath>
#include <gtest/gtest.h>
#include <string>

#include "drivers/world/random.hpp"
#include "firmware/procedure/methods/methods.hpp"
#include "firmware/procedure/methods/needs.hpp"
#include "host-tests/emulation/scenario.hpp"
#include "host-tests/support/runs.hpp"
#include "measured.hpp"
#include "pulls.hpp"

// Methods of the delay that lead the stylus around the datum sphere in contact, on the emulated machine.
namespace probebox::scenario {
namespace {

using namespace std::chrono_literals;
using capture::TouchFault;
using procedure::LiveMethod;
using world::FaultKind;

ProcedureOptions asDescribed(const Scenario& scenario, ProcedureOptions options = {}) {
  return procedure::withReach(options, scenario.facts).value();
}

// Delay, friction, gain and the place of the sphere differ from world to world. The control takes its middle to be
// 0.14 mm and more beside where usualWorld() has it.
world::Config scanWorld(std::uint64_t seed) {
  world::Random random{seed, 96};
  auto config = usualWorld();
  const double tau_s = random.uniform(0.001, 0.009);
  config.delays.tau_machine_s = {tau_s, tau_s, tau_s};
  config.delays.tau_probe_s = random.uniform(0, 0.002);
  config.probe.friction = random.uniform(0, 0.2);
  for (auto& row : config.probe.gain)
    for (double& entry : row) entry += 0.01 * random.normal();
  for (std::size_t axis = 0; axis < 2; ++axis) config.sphere.centre_mm[axis] += random.uniform(-0.02, 0.02);
  return config;
}

void expectHonestScans(const LiveMethod& method, double most_sd_s) {
  Pulls pulls;
  for (std::uint64_t seed = 1; seed <= runs(24); ++seed) {
    Scenario scenario{scanWorld(seed), seed};
    scenario.recorder().keeps_bytes = false;
    scenario.run(2s);
    const auto solved = scenario.calibrate(method, asDescribed(scenario));
    ASSERT_TRUE(solved) << seed << ": " << capture::explain(scenario.state().procedure.last_fault);
    ASSERT_TRUE(solved->ok()) << seed << ": " << solved->error().name << ": " << solved->error().reason;
    EXPECT_EQ(scenario.machine().stylus().contactCount(), scenario.state().procedure.steps);
    EXPECT_EQ(scenario.machine().crashes(), 0U);
    EXPECT_EQ(scenario.controller().abandonedSteps(), 0U);
    add(pulls, solved->value(), "tau_s", {scenario.truth().tau_s[0]}, most_sd_s);
    if (seed == 1) expectTheSameFrom(scenario.dataset(), solved->value());
  }
  pulls.expectHonest();
}

TEST(LiveSteppedScan, FindsTheDelayAsUncertainAsItSays) {
  expectHonestScans(procedure::kDelaySteppedScan, 8e-6);
}

TEST(LiveContour, FindsTheDelayAsUncertainAsItSays) {
  expectHonestScans(procedure::kDelayContour, 8e-6);
}

// Friction adds the same share to every deflection, and none of it is a delay: the same noise, the same answer.
TEST(LiveSteppedScan, DoesNotTakeFrictionForDelay) {
  const auto tauWith = [](double friction) {
    auto config = usualWorld();
    config.probe.friction = friction;
    Scenario scenario{config, 5};
    scenario.recorder().keeps_bytes = false;
    scenario.run(2s);
    const auto solved = scenario.calibrate(procedure::kDelaySteppedScan, asDescribed(scenario));
    EXPECT_TRUE(solved && solved->ok());
    return solved && solved->ok() ? solved->value().find("tau_s")->value() : 0;
  };
  EXPECT_NEAR(tauWith(0.3), tauWith(0), 2e-6);
}

class InTrouble : public testing::TestWithParam<const LiveMethod*> {
 protected:
  // Runs until the box has given the run up, or has all its data. Returns the worst that was said of a step.
  TouchFault faultOf(Scenario& scenario, const ProcedureOptions& options = {}) {
    scenario.recorder().keeps_bytes = false;
    scenario.run(2s);
    run_ = scenario.start(*GetParam(), asDescribed(scenario, options));
    return watch(scenario);
  }
  TouchFault watch(Scenario& scenario) {
    TouchFault seen{};
    scenario.runUntil(
        [&] {
          const auto& progress = scenario.state().procedure;
          if (progress.last_fault != TouchFault::none) seen = progress.last_fault;
          return progress.state == procedure::State::refused || progress.state == procedure::State::solving;
        },
        300s);
    return seen;
  }
  std::uint32_t run_{};
};

TEST_P(InTrouble, AScanAtTheEndOfTheProbesRangeIsGivenUpAtOnce) {
  auto config = usualWorld();
  config.probe.range_mm = 0.45;  // of each channel
  Scenario scenario{config, 3};
  EXPECT_EQ(faultOf(scenario), TouchFault::probe_clipped);
  EXPECT_EQ(scenario.state().procedure.state, procedure::State::refused);
  EXPECT_EQ(scenario.state().procedure.repeats, 1U);
}

TEST_P(InTrouble, AScanThatLosesContactIsAskedForAgainAndThenGivenUp) {
  auto config = usualWorld();
  config.sphere.centre_mm[1] -= 0.4;
  Scenario scenario{config, 3};
  EXPECT_EQ(faultOf(scenario), TouchFault::contact_lost);
  EXPECT_EQ(scenario.state().procedure.state, procedure::State::refused);
  EXPECT_EQ(scenario.machine().crashes(), 0U);
}

TEST_P(InTrouble, ScansOfNothingAtAllAreGivenUp) {
  auto config = usualWorld();
  config.sphere.centre_mm[2] -= 30;
  Scenario scenario{config, 3};
  EXPECT_EQ(faultOf(scenario), TouchFault::contact_lost);
  EXPECT_EQ(scenario.state().procedure.state, procedure::State::refused);
}

TEST_P(InTrouble, AHoleCostsOneScanAndNotTheRun) {
  for (const auto kind : {FaultKind::probe_silent, FaultKind::encoders_silent}) {
    Scenario scenario{usualWorld(), 4};
    scenario.recorder().keeps_bytes = false;
    scenario.run(2s);
    run_ = scenario.start(*GetParam(), asDescribed(scenario));
    ASSERT_TRUE(scenario.runUntil([&] { return scenario.controller().activity() == world::Activity::scanning; }, 30s));
    scenario.inject(kind, 200ms, 30ms);
    EXPECT_EQ(watch(scenario), TouchFault::samples_missing);
    const auto solved = scenario.finish(run_);
    ASSERT_TRUE(solved && solved->ok());
    const auto& tau = *solved->value().find("tau_s");
    EXPECT_LT(std::abs(tau.value() - scenario.truth().tau_s[0]), 4 * *tau.standardDeviation());
  }
}

// The contact holds, and the solver says why there is no answer.
TEST_P(InTrouble, AMiddleThatIsOffByMoreThanAFifthOfAMillimetreIsRefused) {
  auto config = usualWorld();
  config.sphere.centre_mm[0] -= 0.12;
  Scenario scenario{config, 3};
  EXPECT_EQ(faultOf(scenario), TouchFault::none);
  const auto solved = scenario.finish(run_);
  ASSERT_TRUE(solved && !solved->ok());
  EXPECT_EQ(solved->error().name, "centre-error") << solved->error().reason;
}

// Somebody aborts the run while the stylus slides: it comes off the sphere where it is.
TEST_P(InTrouble, AnAbortedScanLeavesTheSphereOutwards) {
  Scenario scenario{usualWorld(), 6};
  scenario.recorder().keeps_bytes = false;
  scenario.run(2s);
  run_ = scenario.start(*GetParam(), asDescribed(scenario));
  ASSERT_TRUE(scenario.runUntil([&] { return scenario.controller().activity() == world::Activity::scanning; }, 30s));
  scenario.run(700ms);
  scenario.push(ProcedureAborted{.run = run_, .at = scenario.now()});
  scenario.run(10s);
  EXPECT_EQ(scenario.controller().activity(), world::Activity::asking);
  EXPECT_EQ(scenario.machine().stylus().contactCount(), 1U) << "and touches nothing on its way";
  const auto solved = scenario.calibrate(*GetParam(), asDescribed(scenario));
  EXPECT_TRUE(solved && solved->ok()) << "the next run is as good as any";
}

INSTANTIATE_TEST_SUITE_P(Scans, InTrouble, testing::Values(&procedure::kDelaySteppedScan, &procedure::kDelayContour),
                         [](const auto& of_one) {
                           std::string name{of_one.param->name()};
                           std::erase(name, '-');
                           return name;
                         });

}  // namespace
}  // namespace probebox::scenario
