#include <algorithm>
#include <cmath>
#include <gtest/gtest.h>
#include <memory>
#include <string>

#include "drivers/world/random.hpp"
#include "firmware/app/results/result_events.hpp"
#include "firmware/metrology/methods.hpp"
#include "firmware/procedure/methods/methods.hpp"
#include "firmware/procedure/methods/sweep.hpp"
#include "firmware/procedure/plan/readiness.hpp"
#include "host-tests/emulation/scenario.hpp"
#include "host-tests/support/runs.hpp"
#include "pulls.hpp"
#include "watched_twin.hpp"

// screw-reference on the emulated machine: the sensor of a cold screw is read at rest.
namespace probebox::scenario {
namespace {

using namespace std::chrono_literals;
using world::FaultKind;

// Cold screws whose sensors read elsewhere than machine.toml says. The encoders are absolute, so that motor and machine
// position are the same.
world::Config coldAt(double reading_um) {
  auto config = warmingWorld();
  config.encoders.power_up_mm = {};
  for (auto& screw : config.machine.screws) screw->reference_um += reading_um;
  for (auto& screw : config.screws) {
    screw->cold_um = screw->warm_um = 0;
    screw->noise_um = 0.1;
    screw->face_um = {3, 0.8};
  }
  return config;
}

void activate(Scenario& scenario, const metrology::Result& result, store::Id id) {
  store::Record record{};
  record.id = id;
  record.binding.subject = metrology::subjectOf(scenario.dataset());
  record.content = result;
  const auto activation = app::activationOf(record, scenario.now());
  ASSERT_TRUE(activation && !activation->empty());
  for (const auto& event : *activation) scenario.push(event);
}

// The face table first, as the box has it in force.
void calibrateFace(Scenario& scenario, std::uint8_t axis) {
  const auto sweep = procedure::sweepOptions({.axis = axis}, scenario.facts);
  ASSERT_TRUE(sweep);
  const auto solved = scenario.calibrate(procedure::kScrewCalibration, *sweep);
  ASSERT_TRUE(solved && solved->ok());
  activate(scenario, solved->value(), 7);
  const auto& table = *solved->value().find("sector_table_um");
  scenario.facts.screws[axis - 1U]->face =
      procedure::ScrewFace{.result_id = 7, .sector_um = table.values, .sd_um = *std::ranges::max_element(table.sd)};
}

std::unique_ptr<Scenario> withFace(const world::Config& config, std::uint64_t seed, std::uint8_t axis) {
  auto scenario = std::make_unique<Scenario>(config, seed);
  scenario->recorder().keeps_bytes = false;
  scenario->run(2s);
  calibrateFace(*scenario, axis);
  return scenario;
}

TEST(ScrewRest, FindsTheColdReadingWithTheUncertaintyThatItStates) {
  Pulls pulls;
  for (std::uint64_t seed = 1; seed <= runs(24); ++seed) {
    world::Random random{seed, 95};
    const double reading_um = random.uniform(-40, 40);
    const auto axis = static_cast<std::uint8_t>(1 + seed % 3);
    auto config = coldAt(reading_um);
    for (auto& screw : config.screws) screw->face_um = {random.uniform(-4, 4), random.uniform(-1, 1)};
    const double truth_um = config.machine.screws[axis - 1U]->reference_um;
    auto scenario = std::make_unique<Scenario>(config, seed);
    scenario->recorder().keeps_bytes = false;
    scenario->facts.screws[axis - 1U]->sector_zero_mm += random.uniform(0, 10);  // the sensor is over any part of one
    scenario->run(2s);
    calibrateFace(*scenario, axis);
    const auto solved = scenario->calibrate(procedure::kScrewReference, {.axis = axis});
    ASSERT_TRUE(solved);
    ASSERT_TRUE(solved->ok()) << solved->error().reason;
    const auto& found = *solved->value().find("reference_um");
    EXPECT_LT(found.sd[0], 0.06);
    EXPECT_GT(found.sd[0], 0.003);
    pulls.add(found.value(), truth_um, found.sd[0]);
    EXPECT_EQ(metrology::subjectOf(scenario->dataset()), std::string{"screw-reference-"} + "xyz"[axis - 1U]);
    EXPECT_EQ(std::get<double>(scenario->dataset().config.at("screw_result")), 7);
    EXPECT_EQ(scenario->machine().stylus().contactCount(), 0U);
  }
  pulls.expectHonest();
}

TEST(ScrewRest, InForceTakesThePlaceOfTheStatedReadingAndLeavesGainAndFace) {
  const auto scenario = withFace(coldAt(25), 3, 1);
  const auto extension_um = [&] { return scenario->state().snapshot.axes[0].screw.extension_um; };
  scenario->run(1s);
  EXPECT_NEAR(extension_um(), 25, 0.6) << "machine.toml states another reading";
  const auto solved = scenario->calibrate(procedure::kScrewReference, {.axis = 1});
  ASSERT_TRUE(solved && solved->ok());
  activate(*scenario, solved->value(), 8);
  scenario->run(1s);
  EXPECT_NEAR(extension_um(), 0, 0.6);
  EXPECT_NEAR(scenario->state().snapshot.axes[0].screw.reference_um, 25, 0.2);
  EXPECT_NEAR(scenario->state().snapshot.axes[1].screw.extension_um, 25, 5) << "another screw";

  // A table that comes later leaves the reference, and a rollback of the reference leaves the table.
  ScrewActivated face{
      .result_id = 9, .axis = Axis::x, .gain = 0.5, .sd_gain = 0, .sectors = 0, .sector_nm = {}, .at = scenario->now()};
  scenario->push(face);
  scenario->run(1s);
  EXPECT_NEAR(scenario->state().snapshot.axes[0].screw.reference_um, 25, 0.2);
  scenario->push(*app::noneInForce("screw-reference-x", scenario->now()));
  scenario->run(1s);
  EXPECT_EQ(scenario->state().snapshot.axes[0].screw.reference_um, usualWorld().machine.screws[0]->reference_um);
  const auto& axis = scenario->state().snapshot.axes[0];
  EXPECT_NEAR(axis.screw.slope * usualFacts().screws[0]->length_mm, -0.5e-3 * axis.screw.extension_um, 1e-9)
      << "the gain of the result";
}

TEST(ScrewRest, IsRefusedWhileTheScrewIsStillCooling) {
  auto config = coldAt(0);
  for (auto& screw : config.screws) {
    screw->cold_um = 40;
    screw->time_constant_s = 1800;  // from 0.02 um/s on
  }
  const auto scenario = withFace(config, 4, 2);
  const auto solved = scenario->calibrate(procedure::kScrewReference, {.axis = 2});
  ASSERT_TRUE(solved && !solved->ok());
  EXPECT_EQ(solved->error().name, "not-steady");
  EXPECT_NE(solved->error().reason.find("let the machine stand"), std::string::npos);
}

TEST(ScrewRest, IsAskedForAgainWhereItWasTooShortOrTheAxisMoved) {
  const auto scenario = withFace(coldAt(0), 5, 1);
  const auto run = scenario->start(procedure::kScrewReference, {.axis = 1});
  scenario->runUntil([&] { return scenario->state().procedure.state == procedure::State::running; }, 10s);
  scenario->run(5s);
  scenario->push(
      Marker{.procedure = run, .step = 0, .phase = MarkerPhase::end, .at_rest = true, .at = scenario->now()});
  scenario->run(100ms);
  EXPECT_EQ(scenario->state().procedure.last_fault, capture::TouchFault::rest_too_short);
  const auto solved = scenario->finish(run);
  ASSERT_TRUE(solved && solved->ok()) << "done again, for the whole time";
}

TEST(ScrewRest, NeedsTheFaceTableAndTakesNoTurns) {
  auto facts = usualFacts();
  const auto why = [&](const ProcedureOptions& asked) {
    procedure::MachineNow now{};
    for (auto& axis : now) axis = {.referenced = true, .position_mm = 0, .screw_sensor_valid = true};
    const auto ready = procedure::readied(procedure::kScrewReference, asked, facts, now);
    return ready ? std::string{} : ready.error().what;
  };
  EXPECT_NE(why({}).find("name its axis"), std::string::npos);
  EXPECT_NE(why({.axis = 1}).find("probebox calibrate screw-calibration --axis X"), std::string::npos);
  facts.screws[0]->face = procedure::ScrewFace{.result_id = 1, .sector_um = {0, 0, 0}, .sd_um = 0.1};
  EXPECT_EQ(why({.axis = 1}), "");
  EXPECT_NE(why({.axis = 1, .turns = 4}).find("takes no turns"), std::string::npos);
  EXPECT_NE(why({.speed_count = 1, .speeds_mm_s = {5}, .axis = 1}).find("takes no speeds"), std::string::npos);
}

TEST(ScrewRest, DoesNotNeedTheProbeAndTakesNoMemoryOnTheTickPath) {
  const auto config = coldAt(3);
  const auto scenario = withFace(config, 6, 3);
  scenario->inject(FaultKind::probe_silent, 0s, 300s);
  WatchedTwin twin{*scenario, config};
  const auto solved = scenario->calibrate(procedure::kScrewReference, {.axis = 3});
  ASSERT_TRUE(solved && solved->ok());
  EXPECT_EQ(twin.allocations, 0U);
}

}  // namespace
}  // namespace probebox::scenario
