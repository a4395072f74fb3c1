#include "firmware/procedure/plan/procedure.hpp"

#include <cmath>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <numbers>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "firmware/procedure/methods/methods.hpp"
#include "firmware/procedure/plan/plan.hpp"
#include "firmware/procedure/plan/prompts.hpp"
#include "firmware/procedure/plan/readiness.hpp"
#include "firmware/procedure/plan/run_dataset.hpp"
#include "locked_clock.hpp"
#include "multi_speed_procedure.hpp"
#include "obedient_machine.hpp"

namespace probebox::procedure {
namespace {

TEST_F(MultiSpeedProcedure, AsksForFivePointsAtEachSpeed) {
  start(1);
  const Plan& plan = procedure.plan();
  ASSERT_EQ(plan.step_count, 25U);
  std::set<double> speeds;
  std::set<std::array<double, 3>> normals;
  for (std::size_t i = 0; i < plan.step_count; ++i) {
    speeds.insert(plan.steps[i].touch.retract_speed_mm_s);
    normals.insert(plan.steps[i].touch.outward_normal);
    EXPECT_EQ(plan.steps[i].touch.step, i);
  }
  EXPECT_EQ(speeds, (std::set<double>{5, 10, 20, 30, 40}));
  EXPECT_EQ(normals.size(), 5U);
  EXPECT_EQ(promptFor(plan, 6),
            "touch 7 of 25: A, B and C at 0 deg; -X side of the sphere, 0.5 mm deep, retract at 10 mm/s until 1.5 mm "
            "beyond the clearance of "
            "0.6 mm");
}

TEST_F(MultiSpeedProcedure, HandsOverTheRecordingOnceWhenAllStepsAreDone) {
  start(7);
  touchAll();
  EXPECT_EQ(procedure.progress().state, State::solving);
  EXPECT_TRUE(procedure.takeReadyToSolve());
  EXPECT_FALSE(procedure.takeReadyToSolve());
  EXPECT_EQ(procedure.recording().touches().size(), 25U);
}

TEST_F(MultiSpeedProcedure, ProposesOrRefusesWithTheWorkersAnswerToThisRunOnly) {
  start(7);
  touchAll();
  procedure.solved({.run = 6, .refused = true, .result_id = 1, .at = {}});
  EXPECT_EQ(procedure.progress().state, State::solving);
  procedure.solved({.run = 7, .refused = false, .result_id = 12, .at = {}});
  EXPECT_EQ(procedure.progress().state, State::proposed);
  EXPECT_EQ(procedure.progress().result_id, 12U);
}

TEST_F(MultiSpeedProcedure, KeepsTheRecordingWhileTheWorkerReadsIt) {
  start(7);
  touchAll();
  start(8);
  procedure.abort({.run = 7, .at = {}});
  EXPECT_EQ(procedure.progress().run, 7U);
  EXPECT_EQ(procedure.recording().touches().size(), 25U);
}

TEST_F(MultiSpeedProcedure, AsksForAFaultyStepAgainAndRefusesAfterTooManyRepeats) {
  start(1);
  machine.touch();
  machine.touchWithALoss();
  EXPECT_EQ(procedure.progress().step, 1U);
  EXPECT_EQ(procedure.progress().last_fault, capture::TouchFault::source_lost);
  machine.touch();
  EXPECT_EQ(procedure.progress().step, 2U);
  EXPECT_EQ(procedure.progress().repeats, 0U);
  for (std::uint32_t i = 0; i <= Procedure::kMostRepeats; ++i) {
    EXPECT_EQ(procedure.progress().state, State::waiting);
    machine.touchWithALoss();
  }
  EXPECT_EQ(procedure.progress().state, State::refused);
}

TEST_F(MultiSpeedProcedure, NeverAsksAgainForAPressThatWasTooDeep) {
  start(1);
  machine.touch();
  machine.touch(/*clipped=*/true);
  EXPECT_EQ(procedure.progress().last_fault, capture::TouchFault::probe_clipped);
  EXPECT_EQ(procedure.progress().state, State::refused);
  EXPECT_EQ(procedure.progress().repeats, 1U);
}

TEST_F(MultiSpeedProcedure, StartsAStepAnewWhenTheMachineBeginsItAgainOrGivesItUp) {
  start(1);
  machine.mark(MarkerPhase::begin);
  machine.mark(MarkerPhase::begin);
  machine.mark(MarkerPhase::abandon);
  EXPECT_EQ(procedure.progress().state, State::waiting);
  machine.touch();
  ASSERT_EQ(procedure.recording().touches().size(), 1U);
  EXPECT_EQ(procedure.recording().machineRowCount(), 10U);
}

TEST_F(MultiSpeedProcedure, PassesAllStepsInADryRunBeforeItMeasures) {
  start(1);
  const auto steps = procedure.progress().steps;
  for (std::uint32_t step = 0; step < steps; ++step) {
    EXPECT_EQ(procedure.progress().step, step);
    machine.mark(MarkerPhase::pass);
  }
  EXPECT_EQ(procedure.progress().step, 0U);
  EXPECT_EQ(procedure.progress().state, State::waiting);
  EXPECT_EQ(procedure.recording().touches().size(), 0U);
  touchAll();
  EXPECT_EQ(procedure.recording().touches().size(), steps);
  EXPECT_EQ(procedure.progress().state, State::solving);
}

TEST_F(MultiSpeedProcedure, MeasuresNothingInTheMiddleOfADryRunAndPassesNothingBehindAReading) {
  start(1);
  machine.mark(MarkerPhase::pass);
  machine.touch();
  EXPECT_EQ(procedure.progress().step, 1U);
  EXPECT_EQ(procedure.recording().touches().size(), 0U);
  EXPECT_EQ(procedure.strayMarkers(), 2U);
  procedure.abort({.run = 1, .at = {}});
  start(2);
  EXPECT_FALSE(procedure.progress().passing);
  machine.touch();
  machine.mark(MarkerPhase::pass);
  EXPECT_EQ(procedure.progress().step, 1U);
  EXPECT_EQ(procedure.strayMarkers(), 3U);
}

TEST_F(MultiSpeedProcedure, AsksAgainWhenTheEndOfAStepNeverComes) {
  start(1);
  machine.mark(MarkerPhase::begin);
  machine.wait(Procedure::kStepTimeout - Nanoseconds{1});
  EXPECT_EQ(procedure.progress().state, State::running);
  machine.wait(Nanoseconds{1});
  EXPECT_EQ(procedure.progress().state, State::waiting);
  EXPECT_TRUE(procedure.progress().timed_out);
}

TEST_F(MultiSpeedProcedure, CountsMarkersThatBelongNowhereAndGoesOn) {
  procedure.mark(Marker{.procedure = 9, .step = 0, .phase = MarkerPhase::begin}, kLocked);
  start(1);
  procedure.mark(Marker{.procedure = 1, .step = 5, .phase = MarkerPhase::begin}, kLocked);
  machine.mark(MarkerPhase::end);
  EXPECT_EQ(procedure.strayMarkers(), 3U);
  touchAll();
  EXPECT_EQ(procedure.progress().state, State::solving);
}

TEST_F(MultiSpeedProcedure, AbortsOnRequestAndCanStartAfresh) {
  start(1);
  machine.touch();
  procedure.abort({.run = 1, .at = {}});
  EXPECT_EQ(procedure.progress().state, State::aborted);
  start(2);
  EXPECT_EQ(procedure.progress().step, 0U);
  EXPECT_EQ(procedure.recording().touches().size(), 0U);
}

class Planned : public testing::Test {
 protected:
  static constexpr ProcedureOptions kSweep{.speed_count = 1, .speeds_mm_s = {0.5}, .axis = 2, .travel_mm = 40};
  static Plan of(const LiveMethod& method, const ProcedureOptions& options = {}) {
    EXPECT_FALSE(validate(method, options, 1.0)) << method.name();
    Plan plan;
    fill(plan, method, options);
    EXPECT_EQ(plan.method, &method);
    return plan;
  }
  static std::string refusal(const LiveMethod& method, const ProcedureOptions& options) {
    const auto error = validate(method, options, 1.0);
    return error ? error->what : "";
  }
};

TEST_F(Planned, EveryMethodHasANameANumberAndStepsThatFit) {
  for (const LiveMethod* method : liveMethods()) {
    EXPECT_EQ(methodNamed(method->name()), method);
    EXPECT_EQ(methodNumbered(liveMethods(), method->number), method);
    const bool sweeps = method->of_screw;  // the screw has to be chosen
    const bool of_a_tool = method->takes_tool;
    const bool by_head = method->kind == Kind::hold;
    const ProcedureOptions options{.tool = of_a_tool ? 4U : 0U,
                                   .head_tool = by_head ? 5U : 0U,
                                   .head_range_mm = by_head ? 0.5 : 0,
                                   .reach_mm = 15.5};
    const Plan plan = of(*method, sweeps ? kSweep : options);
    EXPECT_GT(plan.step_count, 0U);
    for (std::size_t k = 0; k < plan.step_count; ++k) {
      const auto& touch = plan.steps[k].touch;
      double along = 0, length = 0;
      for (std::size_t axis = 0; axis < 3; ++axis) {
        along += touch.outward_normal[axis] * touch.retract_direction[axis];
        length += touch.retract_direction[axis] * touch.retract_direction[axis];
      }
      EXPECT_GE(along, 0.5) << "the approach comes from outside";
      EXPECT_NEAR(length, 1, 1e-9);
      EXPECT_EQ(touch.step, k);
    }
  }
}

// They are in journals and registers: append only.
TEST(LiveMethodNumbers, AreForEver) {
  constexpr std::array kNumbered{"delay-multi-speed",
                                 "delay-known-sphere",
                                 "delay-plates",
                                 "delay-per-axis",
                                 "delay-non-normal",
                                 "delay-in-out",
                                 "centreline",
                                 "c-axis-alignment",
                                 "selftest",
                                 "screw-calibration",
                                 "spindle-offset-2x2",
                                 "spindle-offset-four",
                                 "centreline-limited-access",
                                 "periodic-check",
                                 "rotary-axis-errors",
                                 "table-pivot",
                                 "swivel-error",
                                 "head-pivot",
                                 "a-axis-alignment",
                                 "tool-setter",
                                 "tool-assembly",
                                 "sensor-head-calibration",
                                 "centreline-by-steps",
                                 "pre-travel",
                                 "screw-reference",
                                 "delay-stepped-scan",
                                 "delay-contour",
                                 "machine-check"};
  ASSERT_GE(liveMethods().size(), kNumbered.size());
  std::set<std::uint16_t> numbers{0};
  for (std::size_t i = 0; i < liveMethods().size(); ++i) {
    const LiveMethod& method = *liveMethods()[i];
    EXPECT_TRUE(numbers.insert(method.number).second) << method.name();
    EXPECT_GT(method.number, i == 0 ? 0 : liveMethods()[i - 1]->number) << "in the order of their numbers";
    if (i >= kNumbered.size()) continue;
    EXPECT_EQ(method.number, i + 1);
    EXPECT_EQ(method.name(), kNumbered[i]);
  }
}

TEST_F(Planned, NonNormalComesFromTheAskedAngleOffTheNormal) {
  const Plan plan = of(kDelayNonNormal, {.approach_rad = 0.5});
  ASSERT_EQ(plan.step_count, 11U);
  for (std::size_t k = 0; k < plan.step_count; ++k) {
    const auto& [n, u] = std::pair{plan.steps[k].touch.outward_normal, plan.steps[k].touch.retract_direction};
    EXPECT_NEAR(n[0] * u[0] + n[1] * u[1] + n[2] * u[2], std::cos(0.5), 1e-12);
    EXPECT_GE(u[2], 0) << "nothing reaches the sphere from below";
  }
  EXPECT_NE(promptFor(plan, 0).find("approaching along (-"), std::string::npos);
}

// Two speeds part lost motion from the delay; a single touch closes nothing.
TEST_F(Planned, TouchesOfADelayHaveTwoSpeedsAndCloseWithTheFirst) {
  for (const LiveMethod* method : {&kDelayKnownSphere, &kDelayPlates, &kDelayPerAxis, &kDelayNonNormal, &kDelayInOut}) {
    const Plan plan = of(*method, {});
    const auto &first = plan.steps[0].touch, &last = plan.steps[plan.step_count - 1].touch;
    std::set<double> speeds;
    for (std::size_t i = 0; i < plan.step_count; ++i) speeds.insert(plan.steps[i].touch.retract_speed_mm_s);
    EXPECT_EQ(speeds.size(), 2U) << method->name();
    EXPECT_EQ(plan.step_count, 2 * Sides(method->sides, withDefaults(*method, {}), {}).list().size() + 1)
        << method->name();
    EXPECT_EQ(first.outward_normal, last.outward_normal) << method->name();
    EXPECT_EQ(first.retract_speed_mm_s, last.retract_speed_mm_s) << method->name();
    EXPECT_EQ(last.step, plan.step_count - 1) << method->name();
  }
  ProcedureOptions one;
  one.speed_count = 1;
  one.speeds_mm_s[0] = 10;
  EXPECT_EQ(of(kDelayInOut, one).step_count, 1U);
  EXPECT_EQ(of(kDelayKnownSphere, one).step_count, 6U);
}

TEST_F(Planned, CentrelineReadsOneBallAtEqualAngles) {
  const Plan plan = of(kCentreline, {.angles = 4});
  ASSERT_EQ(plan.step_count, 25U);
  EXPECT_EQ(plan.steps[24].touch.reading, 4U);
  EXPECT_EQ(plan.steps[24].touch.rotary_angles_rad[2], 0) << "the first pose again, last";
  for (std::size_t k = 0; k < 20; ++k) {
    EXPECT_TRUE(plan.steps[k].turns);
    EXPECT_EQ(plan.steps[k].touch.reading, k / 5);
    EXPECT_EQ(plan.steps[k].touch.ball, 1);
    EXPECT_NEAR(plan.steps[k].touch.rotary_angles_rad[2], static_cast<double>(k / 5) * std::numbers::pi / 2, 1e-12);
  }
  EXPECT_EQ(
      promptFor(plan, 5),
      "touch 6 of 25: A at 0, B at 0 and C at 90 deg; +X side of ball 1, 0.5 mm deep, retract at 15 mm/s until 1.5 mm "
      "beyond the clearance of 0.6 mm");
  const Plan arc = of(kCentreline, {.arc_rad = 1.2, .angles = 4});
  EXPECT_NEAR(arc.steps[19].touch.rotary_angles_rad[2], 1.2, 1e-12) << "both ends of an arc are read";
}

TEST_F(Planned, AlignmentReadsEveryBallInFourPoses) {
  const Plan plan = of(kCAxisAlignment);
  ASSERT_EQ(plan.step_count, 65U);
  std::set<std::array<double, 3>> poses;
  for (std::size_t k = 0; k < plan.step_count; ++k) {
    const auto& touch = plan.steps[k].touch;
    poses.insert({static_cast<double>(touch.ball), touch.rotary_angles_rad[0], touch.rotary_angles_rad[2]});
  }
  EXPECT_EQ(poses.size(), 12U);
}

TEST_F(Planned, ASweepMovesOneAxisAndTouchesNothing) {
  const Plan plan = of(kScrewCalibration, kSweep);
  ASSERT_EQ(plan.step_count, 1U);
  EXPECT_EQ(plan.steps[0].kind, Kind::sweep);
  EXPECT_THAT(promptFor(plan, 0), testing::AllOf(testing::StartsWith("step 1 of 1"), testing::HasSubstr("Y alone"),
                                                 testing::HasSubstr("+40 mm"), testing::HasSubstr("0.5 mm/s")));
}

TEST_F(Planned, ARestMovesNothingAndSaysForHowLong) {
  const Plan plan = of(kScrewReference, {.axis = 2});
  ASSERT_EQ(plan.step_count, 1U);
  EXPECT_EQ(plan.steps[0].kind, Kind::rest);
  EXPECT_EQ(plan.steps[0].touch.travel_mm, 0);
  EXPECT_THAT(promptFor(plan, 0), testing::AllOf(testing::StartsWith("step 1 of 1"), testing::HasSubstr("Y cold"),
                                                 testing::HasSubstr("60 s")));
}

TEST_F(Planned, RefusesOptionsThatCannotBeUsedAndSaysWhatCould) {
  using testing::HasSubstr;
  EXPECT_THAT(refusal(kScrewCalibration, {}), testing::AllOf(HasSubstr("1 to"), HasSubstr("(X, Y, Z)")));
  auto faster = kSweep;
  faster.speeds_mm_s[0] = 60;
  EXPECT_THAT(refusal(kScrewCalibration, faster), HasSubstr("0.01 to 50 mm/s"));
  auto deeper = kSweep;
  deeper.overtravel_mm = 0.5;
  EXPECT_THAT(refusal(kScrewCalibration, deeper), HasSubstr("overtravel"));
  EXPECT_THAT(refusal(kDelayInOut, {.axis = 1}), HasSubstr("options axis"));
  EXPECT_THAT(refusal(kCentreline, {.speed_count = 2, .speeds_mm_s = {5, 500}}), HasSubstr("0.5 to 100 mm/s"));
  EXPECT_THAT(refusal(kCentreline, {.overtravel_mm = 1.5}), HasSubstr("0.05 to 1 mm"));
  EXPECT_THAT(refusal(kCentreline, {.clearance_mm = std::nan("")}), HasSubstr("0.1 to 10 mm"));
  EXPECT_THAT(refusal(kCentreline, {.angles = 1}), testing::AllOf(HasSubstr("2 to"), HasSubstr("30 angles")));
  EXPECT_THAT(refusal(kCentreline, {.arc_rad = 7}), testing::AllOf(HasSubstr("1 to"), HasSubstr("360 degrees")));
  EXPECT_THAT(refusal(kDelayNonNormal, {.approach_rad = 1.2}),
              testing::AllOf(HasSubstr("0 to"), HasSubstr("60 degrees")));
  EXPECT_THAT(refusal(kCAxisAlignment, {.balls = 1}), testing::AllOf(HasSubstr("2 to"), HasSubstr("7 balls")));
  EXPECT_THAT(refusal(kCentreline, {.speed_count = 3, .speeds_mm_s = {5, 10, 15}, .angles = 12}),
              HasSubstr("195 touches"));
  EXPECT_THAT(refusal(kDelayPlates, {.angles = 4}), HasSubstr("rotary angles"));
  EXPECT_THAT(refusal(kCentreline, {.balls = 3}), HasSubstr("balls"));
  EXPECT_THAT(refusal(kDelayInOut, {.approach_rad = 0.1}), HasSubstr("approach angle"));
}

TEST(Facts, AMethodIsRefusedWithTheRemedyWhereWhatItNeedsIsNotKnown) {
  using testing::HasSubstr;
  const Facts none;
  EXPECT_FALSE(whyUnready(kDelayMultiSpeed, none, false));
  EXPECT_THAT(whyUnready(kDelayKnownSphere, none, true)->what, HasSubstr("[datum_sphere] diameter_mm"));
  EXPECT_THAT(whyUnready(kDelayPlates, none, true)->what, HasSubstr("[datum_plates.X] gap_mm"));
  EXPECT_THAT(whyUnready(kCentreline, none, false)->what, HasSubstr("calibrate"));
  EXPECT_FALSE(whyUnready(kCentreline, none, true));
  EXPECT_TRUE(kCentreline.finds_a_place);
  EXPECT_FALSE(kDelayMultiSpeed.finds_a_place) << "a delay is the same wherever the axes are";
  Facts told;
  told.sphere_diameter_mm = 25;
  told.gaps[0] = KnownSize{20};
  EXPECT_FALSE(whyUnready(kDelayPerAxis, told, false));
  EXPECT_FALSE(whyUnready(kDelayPlates, told, false));
}

TEST(Facts, AGapIsRefusedWhereTheWayOutOfATouchEndsInTheOppositePlate) {
  Facts facts;
  facts.stylus_ball_diameter_mm = 6;
  const auto ready = [&](double gap_mm, double clearance_mm) {
    facts.gaps[1] = KnownSize{gap_mm};
    return readied(kDelayPlates, {.clearance_mm = clearance_mm}, facts, {});
  };
  const auto refused = ready(5, 0);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().because, Obstacle::option);
  EXPECT_THAT(refused.error().what, testing::HasSubstr("wider gap"));
  EXPECT_FALSE(ready(7.9, 0));
  EXPECT_TRUE(ready(7.9, 0.3));
  EXPECT_TRUE(ready(8.2, 0));
}

TEST(Facts, AProbeThatDoesNotTouchMakesOnlyTheRunThatTouchesNothing) {
  Facts facts;
  facts.distance_probe = DistanceProbe{.stand_off_mm = 20, .range_mm = 0.7};
  facts.datum_cylinder = DatumCylinder{.diameter = {30}, .inside = true};
  for (const LiveMethod* method : {&kDelayCylinder, &kDelayMultiSpeed, &kDelayContour, &kSelftest, &kToolSetter}) {
    const auto why = whyUnready(*method, facts, true);
    ASSERT_TRUE(why) << method->name();
    EXPECT_EQ(why->because, Obstacle::option);
    EXPECT_FALSE(readied(*method, {}, facts, {})) << method->name();
  }
  EXPECT_FALSE(whyUnready(kDelayInOut, facts, false));
  EXPECT_EQ(readied(kDelayInOut, {}, facts, {}).error().because, Obstacle::option) << "0.6 and 0.2 mm leave its range";
  EXPECT_TRUE(readied(kDelayInOut, {.clearance_mm = 0.4}, facts, {}));
  EXPECT_FALSE(readied(kDelayInOut, {.overtravel_mm = 0.8, .clearance_mm = 0.4}, facts, {}));
  Plan plan;
  fill(plan, kDelayInOut, {});
  takeReadings(plan, probeKindOf(facts));
  for (std::size_t i = 0; i < plan.step_count; ++i) {
    EXPECT_EQ(plan.steps[i].touch.outward_normal, (std::array<double, 3>{0, 0, 1}));
    EXPECT_EQ(asked(plan.steps[i]).run_out_mm, kDistanceRunOut_mm);
  }
}

TEST(Methods, HaveNoSetOfSpeedsTwice) {
  for (const auto* method : liveMethods()) {
    std::set<std::vector<double>> different;
    for (const auto& set : method->speed_sets) different.insert({set.begin(), set.end()});
    EXPECT_EQ(different.size(), method->speed_sets.size()) << method->number;
  }
}

// A controller reads the code alone: what never becomes right by waiting is an option, the rest is a state.
TEST(Facts, ARefusalNamesItsCause) {
  Facts facts;
  facts.screws[0] = ScrewFacts{};
  const auto because = [&](const LiveMethod& method, const ProcedureOptions& asked) {
    const auto ready = readied(method, asked, facts, {});
    EXPECT_FALSE(ready);
    return ready ? Obstacle{} : ready.error().because;
  };
  EXPECT_EQ(because(kScrewReference, {.axis = 1}), Obstacle::state) << "no face table is in force";
  EXPECT_EQ(because(kScrewReference, {.axis = 2}), Obstacle::option) << "no such screw";
  EXPECT_EQ(because(kToolSetter, {.tool = 99}), Obstacle::option) << "no such tool";
  EXPECT_EQ(because(kCentreline, {.head = true}), Obstacle::option) << "no sensor head";
  EXPECT_EQ(because(kTablePivot, {.shank = true}), Obstacle::option) << "no shank";
  facts.trigger_probe = TriggerProbe{.repeatability_mm = 0.0005};
  EXPECT_EQ(because(kDelayMultiSpeed, {}), Obstacle::option) << "it delivers no samples";
}

}  // namespace
}  // namespace probebox::procedure
