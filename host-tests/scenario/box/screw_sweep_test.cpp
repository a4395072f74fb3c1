#include <cmath>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <numbers>
#include <vector>

#include "board/describe/parse.hpp"
#include "firmware/app/results/result_events.hpp"
#include "firmware/metrology/methods.hpp"
#include "firmware/procedure/methods/methods.hpp"
#include "firmware/procedure/methods/sweep.hpp"
#include "host-tests/emulation/scenario.hpp"
#include "host-tests/support/runs.hpp"
#include "pulls.hpp"
#include "watched_twin.hpp"

// screw-calibration on the emulated machine: a face that is not plane, turned slowly before its sensor.
namespace probebox::scenario {
namespace {

using namespace std::chrono_literals;
using procedure::LiveMethod;
using world::FaultKind;

constexpr double kWarm_um = 30;

// Screws that have been warm for long. The encoders are absolute, so that motor and machine position are the same.
world::Config warm(double once_um = 3, double twice_um = 0.8) {
  auto config = warmingWorld();
  config.encoders.power_up_mm = {};
  for (auto& screw : config.screws) {
    screw->cold_um = kWarm_um;
    screw->warm_um = kWarm_um;
    screw->noise_um = 0.1;
    screw->face_um = {once_um, twice_um};
  }
  return config;
}

ProcedureOptions sweepOf(std::uint8_t axis, std::vector<double> speeds_mm_s = {}, unsigned turns = 0) {
  ProcedureOptions options{.speed_count = static_cast<std::uint8_t>(speeds_mm_s.size()),
                           .axis = axis,
                           .turns = static_cast<std::uint16_t>(turns)};
  std::ranges::copy(speeds_mm_s, options.speeds_mm_s.begin());
  const auto sweep = procedure::sweepOptions(options, usualFacts());
  EXPECT_TRUE(sweep) << sweep.error().what;
  return sweep ? *sweep : options;
}

// The mean of the face over each sector, less that over the whole turn.
std::vector<double> sectorsOf(const world::Screws& screws, std::size_t axis, std::size_t count) {
  constexpr int kSteps = 1000;
  const auto screw = usualFacts().screws[axis].value();
  std::vector<double> means(count);
  double mean = 0;
  for (std::size_t sector = 0; sector < count; ++sector) {
    for (int i = 0; i < kSteps; ++i) {
      const double turns = (static_cast<double>(sector) + (i + 0.5) / kSteps) / static_cast<double>(count);
      means[sector] += screws.face_um(axis, screw.sector_zero_mm + turns * screw.pitch_mm) / kSteps;
    }
    mean += means[sector] / static_cast<double>(count);
  }
  for (auto& value : means) value -= mean;
  return means;
}

void activate(Scenario& scenario, const metrology::Result& result) {
  store::Record record{};
  record.id = 7;
  record.binding.subject = metrology::subjectOf(scenario.dataset());
  record.content = result;
  const auto activation = app::activationOf(record, scenario.now());
  ASSERT_TRUE(activation && !activation->empty());
  for (const auto& event : *activation) scenario.push(event);
}

TEST(ScrewSweep, FindsTheFaceWithTheUncertaintyThatItStates) {
  Pulls pulls;
  for (std::uint64_t seed = 1; seed <= runs(6); ++seed) {
    const auto axis = static_cast<std::size_t>(seed % 3);
    Scenario scenario{warm(1 + 0.5 * static_cast<double>(seed), 0.2 * static_cast<double>(seed)), seed};
    scenario.recorder().keeps_bytes = false;
    scenario.run(2s);
    const auto solved = scenario.calibrate(procedure::kScrewCalibration, sweepOf(static_cast<std::uint8_t>(axis + 1)));
    ASSERT_TRUE(solved) << "seed " << seed;
    ASSERT_TRUE(solved->ok()) << solved->error().reason;
    EXPECT_EQ(metrology::subjectOf(scenario.dataset()), std::string{"screw-"} + "xyz"[axis]);
    const auto& table = *solved->value().find("sector_table_um");
    ASSERT_EQ(table.values.size(), kMostScrewSectors);
    const auto truth = sectorsOf(scenario.world().screws(), axis, table.values.size());
    for (std::size_t i = 0; i < truth.size(); ++i) {
      EXPECT_LT(table.sd[i], 0.03);
      pulls.add(table.values[i], truth[i], table.sd[i]);
    }
    EXPECT_LT(std::abs(solved->value().find("drift_um_s")->value()), 1e-3);
    EXPECT_EQ(solved->value().find("K"), nullptr) << "true errors were not measured";
    EXPECT_EQ(scenario.machine().stylus().contactCount(), 0U);
  }
  pulls.expectHonest();
}

// Root mean squares while the screw is turned, um of the whole extension.
struct LeftOver {
  double served_um{};    // of the nut's error beside what is served against it
  double measured_um{};  // of the true extension beside the one that is taken out of what is measured
};

LeftOver leftOver(Scenario& scenario, std::size_t axis) {
  const auto screw = usualFacts().screws[axis].value();
  LeftOver squares;
  int count = 0;
  scenario.start(procedure::kScrewCalibration, sweepOf(static_cast<std::uint8_t>(axis + 1)));
  scenario.runUntil([&] { return scenario.state().procedure.state == procedure::State::running; }, 10s);
  scenario.run(1s);
  for (; scenario.state().procedure.state == procedure::State::running; ++count) {
    const double position_mm = scenario.machine().positionAt(scenario.now())[axis];
    const double lever = (position_mm + screw.offset_mm) / screw.length_mm;
    const double error_mm = scenario.world().screws().nutError_mm(axis, position_mm, scenario.now());
    const double left_um = (error_mm + scenario.state().snapshot.correction_mm[axis]) / lever * 1e3;
    const double unknown_um = scenario.state().snapshot.axes[axis].screw.extension_um - kWarm_um;
    squares.served_um += left_um * left_um;
    squares.measured_um += unknown_um * unknown_um;
    scenario.run(130ms);
  }
  EXPECT_GT(count, 500);
  return {std::sqrt(squares.served_um / count), std::sqrt(squares.measured_um / count)};
}

TEST(ScrewSweep, InForceTakesTheFaceOutOfWhatIsServedAndMeasured) {
  Scenario scenario{warm(), 5};
  scenario.recorder().keeps_bytes = false;
  scenario.run(2s);
  const auto before = leftOver(scenario, 0);
  const auto solved = scenario.finish(1);
  ASSERT_TRUE(solved && solved->ok());
  activate(scenario, solved->value());
  const auto after = leftOver(scenario, 0);
  // The root mean square of two harmonics of 3 and 0.8 um.
  EXPECT_NEAR(before.served_um, std::sqrt((9 + 0.64) / 2), 0.15);
  EXPECT_NEAR(before.measured_um, std::sqrt((9 + 0.64) / 2), 0.15);
  // A reading's noise is 0.1 um; of the face a table of 24 sectors leaves 0.03 um, and would leave 0.18 um in steps.
  EXPECT_NEAR(after.served_um, std::hypot(0.03, 0.1), 0.03);
  EXPECT_NEAR(after.measured_um, std::hypot(0.03, 0.1), 0.03);
}

TEST(ScrewSweep, IsRefusedWhileTheScrewIsStillWarming) {
  auto config = warm();
  for (auto& screw : config.screws) {
    screw->warm_um = 330;
    screw->time_constant_s = 600;
  }
  Scenario scenario{config};
  scenario.recorder().keeps_bytes = false;
  scenario.run(2s);
  const auto solved = scenario.calibrate(procedure::kScrewCalibration, sweepOf(2, {2}));
  ASSERT_TRUE(solved);
  ASSERT_FALSE(solved->ok());
  EXPECT_EQ(solved->error().name, "not-steady");
}

TEST(ScrewSweep, IsRefusedWhenTheAxisDoesNotTurnTheScrew) {
  Scenario scenario{warm()};
  scenario.recorder().keeps_bytes = false;
  scenario.run(2s);
  scenario.start(procedure::kScrewCalibration, sweepOf(1, {1}));
  scenario.runUntil([&] { return scenario.state().procedure.state == procedure::State::running; }, 10s);
  // The counts stand still for the last half of four turns.
  scenario.inject(FaultKind::encoders_stuck, 20s, 30s);
  const auto solved = scenario.finish(1);
  ASSERT_TRUE(solved);
  ASSERT_FALSE(solved->ok());
  EXPECT_EQ(solved->error().name, "too-few-turns");
}

TEST(ScrewSweep, IsAskedForAgainAndThenRefusedWhenTheSensorIsSilent) {
  Scenario scenario{warm()};
  scenario.recorder().keeps_bytes = false;
  scenario.run(2s);
  scenario.start(procedure::kScrewCalibration, sweepOf(3, {5}));
  scenario.inject(FaultKind::screw_sensors_silent, 0s, 200s);
  ASSERT_TRUE(scenario.runUntil([&] { return scenario.state().procedure.state == procedure::State::refused; }, 150s));
  EXPECT_EQ(scenario.state().procedure.last_fault, capture::TouchFault::no_drift_rows);
  EXPECT_FALSE(scenario.recorded().run_to_solve);
}

TEST(ScrewSweep, DoesNotNeedTheProbe) {
  Scenario scenario{warm()};
  scenario.recorder().keeps_bytes = false;
  scenario.run(2s);
  scenario.inject(FaultKind::probe_silent, 0s, 200s);
  const auto solved = scenario.calibrate(procedure::kScrewCalibration, sweepOf(1, {2}));
  ASSERT_TRUE(solved);
  EXPECT_TRUE(solved->ok()) << solved->error().reason;
}

TEST(ScrewSweep, TakesNoMemoryOnTheTickPath) {
  const auto config = warm();
  Scenario scenario{config};
  scenario.recorder().keeps_bytes = false;
  WatchedTwin twin{scenario, config};
  ASSERT_TRUE(scenario.calibrate(procedure::kScrewCalibration, sweepOf(1, {2})));
  EXPECT_TRUE(twin.outputs.run_to_solve);
  EXPECT_EQ(twin.allocations, 0U);
}

TEST(SweepOptions, SayWhatCannotBeTurned) {
  const auto refusal = [](ProcedureOptions options, unsigned turns = 0) {
    options.turns = static_cast<std::uint16_t>(turns);
    const auto sweep = procedure::sweepOptions(options, usualFacts());
    return sweep ? std::string{} : sweep.error().what;
  };
  const auto says = [](const std::string& text, const char* what) { return text.find(what) != std::string::npos; };
  EXPECT_TRUE(says(refusal({}), "name its axis"));
  EXPECT_TRUE(says(refusal({.axis = 1}, 2), "2 turns are not possible: give 3 to 20"));
  // 12 mm/s of a pitch of 10 mm.
  EXPECT_TRUE(says(refusal({.speed_count = 1, .speeds_mm_s = {12}, .axis = 1}), "at 72 rpm"));
  EXPECT_TRUE(says(refusal({.speed_count = 1, .speeds_mm_s = {12}, .axis = 1}), "give at most 9 mm/s"));
  auto facts = usualFacts();
  facts.screws[1].reset();
  EXPECT_TRUE(says(procedure::sweepOptions({.axis = 2}, facts).error().what, "give [screw.Y] in machine.toml"));
  // 98304 positions, one every 10 ms, less a minute: 200 mm in 923 s.
  const std::string slow = refusal({.speed_count = 1, .speeds_mm_s = {0.1}, .axis = 1}, 20);
  EXPECT_TRUE(says(slow, "takes 2000 s, but a recording holds at most 923.04 s: give at least 0.217 mm/s")) << slow;
  EXPECT_EQ(refusal({.speed_count = 1, .speeds_mm_s = {0.217}, .axis = 1}, 20), "");
  const auto usual = sweepOf(1);
  EXPECT_DOUBLE_EQ(usual.travel_mm, 40) << "four turns";
  EXPECT_DOUBLE_EQ(usual.speeds_mm_s[0], 0.5) << "3 rpm";
}

TEST(SweepRoom, IsLookedForBeforeTheStart) {
  auto facts = usualFacts();
  facts.screws[1]->travel_min_mm = -50;
  facts.screws[1]->travel_max_mm = 300;
  const auto why = [&](double from_mm, unsigned turns) {
    const auto error = procedure::whyNoRoom(sweepOf(2, {}, turns), from_mm, facts);
    return error ? error->what : std::string{};
  };
  EXPECT_EQ(why(-50, 20), "");
  EXPECT_EQ(why(100, 20), "") << "200 mm, to the very end";
  EXPECT_THAT(why(100.5, 20), testing::AllOf(testing::HasSubstr("+200 mm"), testing::HasSubstr("100.5 mm"),
                                             testing::HasSubstr("300 mm"), testing::HasSubstr("-50 and 100 mm")));
  facts.screws[1]->travel_max_mm = 100;
  EXPECT_THAT(why(-50, 20), testing::HasSubstr("-50 to 100 mm"));
}

// What is there is what machine.toml says.
TEST(SweepRoom, IsThatOfTheAxis) {
  const auto facts = usualFacts();
  const auto machine = board::simDescriptions()->machine;
  for (std::size_t axis = 0; axis < kLinearAxes; ++axis) {
    EXPECT_EQ(facts.screws[axis]->travel_min_mm, machine.axes[axis].travel_min_mm);
    EXPECT_EQ(facts.screws[axis]->travel_max_mm, machine.axes[axis].travel_max_mm);
  }
}

}  // namespace
}  // namespace probebox::scenario
