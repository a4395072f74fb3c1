#include <array>
#include <cmath>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <optional>

#include "drivers/world/random.hpp"
#include "firmware/app/results/result_events.hpp"
#include "firmware/metrology/methods.hpp"
#include "firmware/procedure/methods/methods.hpp"
#include "firmware/procedure/plan/readiness.hpp"
#include "host-tests/emulation/scenario.hpp"
#include "host-tests/support/runs.hpp"
#include "measured.hpp"
#include "protocol/units/angle.hpp"
#include "pulls.hpp"
#include "rim_truth.hpp"
#include "touch_trigger_probe.hpp"

// centreline-by-steps with step 2 of the large lathe on the emulated machine: C turns until the ball touches the stylus
// on either side of the line (B25), and the loops begin from the zero of C that this shows.
namespace probebox::scenario {
namespace {

using namespace std::chrono_literals;
using capture::TouchFault;
using testing::HasSubstr;
using world::operator+;
using world::operator-;

const std::uint64_t kContactSeeds = runs(24);
constexpr double kOff_deg = 3;  // by which the ball was put beside the line by hand

world::Config rimWorld(std::uint64_t seed) {
  auto config = usualWorld();
  world::Random random{seed, 57};
  auto& part = config.part_spindle;
  part.point_mm[0] += random.uniform(-0.05, 0.05);
  part.point_mm[1] += random.uniform(-0.05, 0.05);
  for (double& offset : config.probe_spindle.stylus_offset_mm) offset = random.uniform(-0.03, 0.03);
  return config;
}

world::Config triggerWorld(std::uint64_t seed) {
  auto config = rimWorld(seed);
  world::Random random{seed, 58};
  config.touch_trigger = someSwitch(random);
  return config;
}

ProcedureOptions options(Scenario& scenario, double off_deg = kOff_deg) {
  scenario.facts.rim_ball->c_on_line_rad = (90 - off_deg) * kDegree;
  const auto described = procedure::described(procedure::kCentrelineBySteps, {.contacts = true}, scenario.facts);
  EXPECT_TRUE(described) << described.error().what;
  return described.value();
}

// Clockwise from `from_rad`: C at which ball 1 touches the stylus ball there, coming from the other side of the line.
double contactAt(const world::Config& config, const world::Machine& machine, const world::Vector3& tip, double side,
                 double from_rad) {
  const auto& part = config.part_spindle;
  const double reach_mm = part.ball_radius_mm + config.sphere.stylus_ball_radius_mm;
  const auto apart = [&](double clockwise_rad) {
    const world::PartPose pose{.c_rad = from_rad - clockwise_rad, .tilt_rad = 0};
    return world::norm(machine.partPoint(part.point_mm + part.balls_mm[0], pose) - tip);
  };
  double free = -0.3 * side, met = 0.3 * side;
  for (int i = 0; i < 60; ++i) {
    const double middle = (free + met) / 2;
    (apart(middle) > reach_mm ? free : met) = middle;
  }
  return free;
}

// The middle of the angles at which the ball really meets the stylus, where the controller stands it.
double trueMiddle_rad(const Scenario& scenario, const world::Config& config, double from_rad) {
  const auto part = controllerOf(config).known.part_spindle;
  const auto& [x, y, z] = part.balls_mm[0];
  double sum_rad = 0;
  for (const double side : {1.0, -1.0}) {
    const world::Vector3 beside{side * *scenario.facts.rim_ball->beside_mm, std::hypot(x, y), z};
    const world::Vector3 tip = part.point_mm + beside + scenario.machine().tipIn({}, 1);
    sum_rad += contactAt(config, scenario.machine(), tip, side, from_rad);
  }
  return sum_rad / 2;
}

struct Pairs {
  Pulls shift, centre;
};

void add(Pairs& pairs, Scenario& scenario, const world::Config& config, const metrology::Result& result) {
  EXPECT_TRUE(result.warnings.empty()) << result.warnings.front();
  EXPECT_EQ(scenario.machine().crashes(), 0U);
  const double from_rad = scenario.facts.rim_ball->c_on_line_rad;
  const double truth_rad = trueMiddle_rad(scenario, config, from_rad);
  EXPECT_NEAR(truth_rad, -kOff_deg * kDegree, 0.02) << "that is how far the ball was off";
  scenario::add(pairs.shift, result, "contact_shift_rad", {truth_rad}, 3e-5);
  const auto centre = trueCentre(config, scenario.machine());
  scenario::add(pairs.centre, result, "centre_mm", {centre[0], centre[1]}, 1e-3);
}

TEST(RimContacts, OfAScanningProbeFindTheZeroOfCAsUncertainAsItSays) {
  Pairs pairs;
  for (std::uint64_t seed = 1; seed <= kContactSeeds; ++seed) {
    const auto config = rimWorld(seed);
    Scenario scenario{config, seed};
    const auto result = measured(scenario, procedure::kCentrelineBySteps, options(scenario));
    ASSERT_TRUE(result);
    add(pairs, scenario, config, *result);
    if (seed == 1) expectTheSameFrom(scenario.dataset(), *result);
  }
  pairs.shift.expectHonest();
  pairs.centre.expectHonest();
}

TEST(RimContacts, OfATouchTriggerProbeFindItAsUncertainAsItSays) {
  Pairs pairs;
  for (std::uint64_t seed = 1; seed <= kContactSeeds; ++seed) {
    const auto config = triggerWorld(seed);
    Scenario scenario{config, seed};
    scenario.recorder().keeps_bytes = false;
    scenario.run(2s);
    const auto qualified = scenario.calibrate(procedure::kPreTravel);
    ASSERT_TRUE(qualified && qualified->ok());
    scenario.facts.trigger_probe->pre_travels = {acceptedPreTravel(scenario, qualified->value())};
    const auto solved = scenario.calibrate(procedure::kCentrelineBySteps, options(scenario));
    ASSERT_TRUE(solved);
    ASSERT_TRUE(solved->ok()) << solved->error().reason;
    add(pairs, scenario, config, solved->value());
  }
  pairs.shift.expectHonest();
}

// Loops that begin where the contacts put the zero do not begin where it was put by hand.
TEST(RimContacts, MoveTheZeroOfTheFirstLoop) {
  Scenario scenario{rimWorld(2), 2};
  ASSERT_TRUE(measured(scenario, procedure::kCentrelineBySteps, options(scenario)));
  const auto& contacts = *scenario.dataset().table("contacts");
  ASSERT_EQ(contacts.rows(), 1U);
  const double c1 = contacts.column("C1_rad")->front(), c2 = contacts.column("C2_rad")->front();
  EXPECT_GT(c1, c2) << "the stylus stood further from the line than the radii";
  EXPECT_NEAR((c1 + c2) / 2, -kOff_deg * kDegree, 0.02);
  const auto& y = *scenario.dataset().table("readings")->column("y_mm");
  EXPECT_LT(std::abs(y[0] - y[1]), 0.3) << "3 degrees would be 2 mm on this rim";
  EXPECT_EQ(scenario.state().procedure.steps, 2U + 5U * (2U + scenario.dataset().table("readings")->rows()));
}

std::optional<metrology::Solved> begun(Scenario& scenario, const ProcedureOptions& chosen) {
  scenario.recorder().keeps_bytes = false;
  scenario.run(2s);
  scenario.activateDelay(scenario.truth().tau_s);
  return scenario.calibrate(procedure::kCentrelineBySteps, chosen);
}

// The ball is somewhere else, and C turns past the stylus.
TEST(RimContacts, AreRefusedWhereNothingTouches) {
  Scenario scenario{rimWorld(3), 3};
  const auto solved = begun(scenario, options(scenario, 120));
  EXPECT_FALSE(solved);
  EXPECT_EQ(scenario.state().procedure.state, procedure::State::refused);
  EXPECT_EQ(scenario.state().procedure.last_fault, TouchFault::no_contact);
  EXPECT_THAT(capture::explain(TouchFault::no_contact),
              testing::AllOf(HasSubstr("beside_mm"), HasSubstr("[rim_ball]"), HasSubstr("machine.toml")));
  EXPECT_EQ(scenario.machine().crashes(), 0U);
}

TEST(RimContacts, AreRefusedWithoutAnEncoderOfC) {
  Scenario scenario{rimWorld(4), 4};
  const auto chosen = options(scenario);
  scenario.describeBy([](box::BoxConfig& box) { box.corrections.angles[2] = {}; });
  scenario.restartBox();
  EXPECT_FALSE(begun(scenario, chosen));
  EXPECT_EQ(scenario.state().procedure.last_fault, TouchFault::no_angles);
}

TEST(RimContacts, AreRefusedWhereCIsReferencedAnewBetweenThem) {
  auto config = rimWorld(5);
  config.c_power_up_deg = 12;
  Scenario scenario{config, 5};
  const auto chosen = options(scenario);
  const auto referenceC = [&] {
    const double c_rad = scenario.machine().commandedPose().c_rad;
    scenario.push(PoseTold{.axes = 4,
                           .angles_rad = {0, 0, c_rad},
                           .has_tool = false,
                           .tool = 0,
                           .tool_length_mm = 0,
                           .at = scenario.now()});
  };
  scenario.recorder().keeps_bytes = false;
  scenario.run(2s);
  referenceC();
  scenario.activateDelay(scenario.truth().tau_s);
  scenario.start(procedure::kCentrelineBySteps, chosen);
  const auto& run = scenario.state().procedure;
  ASSERT_TRUE(scenario.runUntil([&] { return run.step == 1 && run.state == procedure::State::waiting; }, 120s))
      << capture::explain(run.last_fault);
  scenario.push(SourceLost{Source::encoders, LossReason::disconnected, 0, scenario.now(), axisBit(RotaryAxis::c)});
  scenario.run(300ms);
  referenceC();
  ASSERT_TRUE(scenario.runUntil([&] { return run.state == procedure::State::refused; }, 60s));
  EXPECT_EQ(run.last_fault, TouchFault::zero_lost);
  EXPECT_EQ(run.step, 1U);
}

}  // namespace
}  // namespace probebox::scenario
