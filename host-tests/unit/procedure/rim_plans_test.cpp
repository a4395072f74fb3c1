#include <cmath>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <memory>
#include <numbers>
#include <string>
#include <vector>

#include "firmware/procedure/facts/facts.hpp"
#include "firmware/procedure/methods/methods.hpp"
#include "firmware/procedure/methods/rim_loops.hpp"
#include "firmware/procedure/plan/plan.hpp"
#include "firmware/procedure/plan/procedure.hpp"
#include "firmware/procedure/plan/readiness.hpp"
#include "firmware/procedure/plan/run_dataset.hpp"
#include "obedient_machine.hpp"
#include "protocol/units/angle.hpp"
#include "refusal.hpp"

// centreline-by-steps: what is asked for, loop by loop, and how a run goes on.
namespace probebox::procedure {
namespace {

using testing::DoubleNear;
using testing::ElementsAre;
using testing::HasSubstr;

constexpr ProcedureOptions kOptions{.c_on_line_rad = 90 * kDegree};

// Of every reading, in degrees.
std::vector<double> anglesOfC(const RimLoops& loops, const ProcedureOptions& options = kOptions) {
  const auto plan = std::make_unique<Plan>();
  fill(*plan, kCentrelineBySteps, options, stateOf(loops));
  std::vector<double> angles;
  for (std::size_t k = 0; k < plan->step_count; k += 5)
    angles.push_back(plan->steps[k].touch.rotary_angles_rad[2] / kDegree);
  return angles;
}

// C of the machine is right-handed, the angles of the method are clockwise.
TEST(RimPlan, ReadsToEitherSideOfTheZeroThatIsInForce) {
  const auto near = [](double angle) { return DoubleNear(angle, 1e-9); };
  EXPECT_THAT(anglesOfC({}), ElementsAre(near(90), near(90), near(50), near(130)));
  RimLoops loops{.count = 2, .zeros_rad = {0, 2 * kDegree}, .closes = false};
  EXPECT_THAT(anglesOfC(loops), ElementsAre(near(90), near(90), near(50), near(130), near(48), near(128)));
  loops.closes = true;
  EXPECT_THAT(anglesOfC(loops), ElementsAre(near(90), near(90), near(50), near(130), near(48), near(128), near(88)));
  EXPECT_THAT(anglesOfC({}, {.arc_rad = 60 * kDegree}), ElementsAre(near(0), near(0), near(-30), near(30)));
}

TEST(RimPlan, ReadsTheStylusFirstWithTheSpindleTurnedByHalfATurn) {
  const auto plan = std::make_unique<Plan>();
  fill(*plan, kCentrelineBySteps, kOptions);
  ASSERT_EQ(plan->step_count, 20U);
  for (std::size_t k = 0; k < 20; ++k) {
    const auto& touch = plan->steps[k].touch;
    EXPECT_EQ(touch.rotary_angles_rad[0], k / 5 == 1 ? std::numbers::pi : 0);
    EXPECT_EQ(rimStep(touch.note).loop, k < 10 ? 0 : 1);
    EXPECT_EQ(touch.reading, k / 5);
    EXPECT_EQ(touch.ball, 1);
  }
}

TEST(RimPlan, HasRoomForAllLoops) {
  EXPECT_EQ(refusal(kCentrelineBySteps, kOptions, 1), "");
  auto options = kOptions;
  options.speed_count = 3;
  options.speeds_mm_s = {10, 20, 30};
  EXPECT_THAT(refusal(kCentrelineBySteps, options, 1), HasSubstr("195 touches"));
  EXPECT_THAT(refusal(kCentrelineBySteps, {.arc_rad = 0.4}, 1),
              testing::AllOf(HasSubstr("30 to"), HasSubstr("360 degrees")));
  EXPECT_THAT(refusal(kCentrelineBySteps, {.angles = 5}, 1), HasSubstr("rotary angles"));
}

TEST(RimPlan, NeedsToKnowWhereTheLineIs) {
  Facts facts;
  EXPECT_THAT(whyUnready(kCentrelineBySteps, facts, true)->what,
              testing::AllOf(HasSubstr("[rim_ball]"), HasSubstr("c_deg")));
  facts.rim_ball = RimBall{.c_on_line_rad = 1.5, .level_limit_mm = {}};
  EXPECT_FALSE(whyUnready(kCentrelineBySteps, facts, true));
  EXPECT_THAT(whyUnready(kCentrelineBySteps, facts, false)->what, HasSubstr("calibrate"));
  EXPECT_EQ(described(kCentrelineBySteps, {}, facts).value().c_on_line_rad, 1.5);
  EXPECT_EQ(described(kCentreline, {}, facts).value().c_on_line_rad, 0);
}

constexpr ProcedureOptions kWithContacts{.c_on_line_rad = 90 * kDegree, .contact_beside_mm = 300, .rim_radius_mm = 600};

TEST(RimPlan, TurnsCTowardsTheStylusOnEitherSideFirstAndAsksForNothingElseUntilItKnowsTheZero) {
  const auto plan = std::make_unique<Plan>();
  fill(*plan, kCentrelineBySteps, kWithContacts);
  ASSERT_EQ(plan->step_count, 2U);
  for (const double side : {1, -1}) {
    const auto& step = plan->steps[side > 0 ? 0 : 1];
    ASSERT_TRUE(step.touch.until_contact);
    EXPECT_EQ(step.kind, Kind::turn);
    EXPECT_EQ(step.touch.outward_normal[0], side);
    EXPECT_EQ(step.touch.travel_mm, 300);
    // From beyond the line, by as much as the stylus stands on this side; X falls as C rises.
    EXPECT_NEAR(600 * std::cos(step.touch.rotary_angles_rad[2]), -side * 300, 1e-9);
    EXPECT_NEAR(600 * std::cos(step.touch.until_contact->to_rad), side * 300, 1e-9);
    EXPECT_NEAR(600 * step.touch.until_contact->speed_rad_s, step.touch.retract_speed_mm_s, 1e-9);
    EXPECT_GT(step.overtravel_mm, 0);
  }
  fill(*plan, kCentrelineBySteps, kWithContacts, stateOf({.zeros_rad = {0.02}, .contacted = true}));
  ASSERT_EQ(plan->step_count, 22U);
  EXPECT_NEAR(plan->steps[2].touch.rotary_angles_rad[2], 90 * kDegree - 0.02, 1e-12) << "the stylus, at the new zero";
  EXPECT_NEAR(plan->steps[12].touch.rotary_angles_rad[2], 50 * kDegree - 0.02, 1e-12);
}

// C may turn as slowly as a third of what it was asked for.
TEST(RimProcedure, WaitsForAContactForAsLongAsTheTurnToItMayTake) {
  Procedure procedure{liveMethods(), capture::Capacity{}};
  auto options = kWithContacts;
  options.c_on_line_rad = 150 * kDegree;
  procedure.start({.run = 1, .method = kCentrelineBySteps.number, .at = {}, .options = options});
  ObedientMachine machine{procedure};
  Marker begin{.procedure = 1, .step = 0, .phase = MarkerPhase::begin, .at = monoTime(0)};
  begin.rotary_angles_rad = procedure.plan().steps[0].touch.rotary_angles_rad;
  begin.at_rest = true;
  procedure.mark(begin, kLocked);
  // Over 600 mm, 300 mm to either side of the line.
  const auto& touch = procedure.plan().steps[0].touch;
  const double longest_s = 3 * 2 * std::asin(0.5) / touch.until_contact->speed_rad_s;
  machine.wait(Procedure::kStepTimeout + Nanoseconds{std::llround(0.999e9 * longest_s)});
  EXPECT_EQ(procedure.progress().state, State::running);
  machine.wait(Nanoseconds{std::llround(0.002e9 * longest_s)});
  EXPECT_TRUE(procedure.progress().timed_out);
}

TEST(RimPlan, SaysWhatContactsLack) {
  Facts facts;
  facts.rim_ball = RimBall{.c_on_line_rad = 1.5, .level_limit_mm = {}};
  const auto lacks = [&] {
    const auto options = described(kCentrelineBySteps, {.contacts = true}, facts);
    return options ? std::string{} : options.error().what;
  };
  EXPECT_THAT(lacks(), testing::AllOf(HasSubstr("[rim_ball]"), HasSubstr("beside_mm"), HasSubstr("radius_mm"),
                                      HasSubstr("machine.toml")));
  facts.rim_ball->beside_mm = 30;
  facts.rim_ball->radius_mm = 600;
  EXPECT_THAT(lacks(), testing::AllOf(HasSubstr("[rotary_axis.C]"), HasSubstr("angle_from = \"encoder\"")));
  facts.rim_ball->c_has_encoder = true;
  EXPECT_EQ(lacks(), "");
  EXPECT_EQ(described(kCentrelineBySteps, {}, facts)->contact_beside_mm, 0) << "nobody asked for them";
  EXPECT_EQ(described(kCentrelineBySteps, {.contacts = true}, facts)->contact_beside_mm, 30);
  EXPECT_THAT(readied(kCentreline, {.contacts = true}, facts, {}).error().what, HasSubstr("contacts"));
  EXPECT_THAT(refusal(kCentrelineBySteps, {.contact_beside_mm = 30, .rim_radius_mm = 31}, 1),
              HasSubstr("1 to 24.8 mm"));
}

class RimRun : public testing::Test {
 protected:
  RimRun() {
    procedure.start({.run = 1, .method = kCentrelineBySteps.number, .at = {}, .options = kOptions});
    touchAll();
  }
  // To the end of the steps that are known.
  void touchAll() {
    while (procedure.progress().state == State::waiting) {
      machine.angles_rad = procedure.plan().steps[procedure.progress().step].touch.rotary_angles_rad;
      machine.touch();
    }
  }
  void goOn(std::uint8_t loops, double zero_rad, bool closes, std::uint32_t run = 1) {
    procedure.solved({.run = run, .at = {}, .loops = loops, .c_zero_rad = zero_rad, .closes = closes});
  }
  const Progress& progress() const { return procedure.progress(); }

  Procedure procedure{liveMethods(), capture::Capacity{}};
  ObedientMachine machine{procedure};
};

TEST_F(RimRun, GoesOnWithTheLoopThatTheReadingsAskFor) {
  ASSERT_EQ(progress().state, State::solving);
  EXPECT_TRUE(procedure.takeReadyToSolve());
  goOn(2, 0.02, false);
  EXPECT_EQ(progress().state, State::waiting);
  EXPECT_EQ(progress().step, 20U);
  EXPECT_EQ(progress().steps, 30U);
  EXPECT_EQ(rimLoops(progress().loops).zeros_rad[1], 0.02) << "for whoever says what the step is";
  touchAll();
  ASSERT_EQ(progress().state, State::solving);
  EXPECT_TRUE(procedure.takeReadyToSolve()) << "once more";
  goOn(2, 0.02, true);
  EXPECT_EQ(progress().steps, 35U);
  touchAll();
  EXPECT_TRUE(procedure.takeReadyToSolve());
  EXPECT_EQ(procedure.recording().touches().size(), 35U) << "all of the run is there";
  EXPECT_EQ(rimStep(procedure.recording().touches().back().request.note).zero_rad, 0.02);
  procedure.solved({.run = 1, .refused = false, .result_id = 7, .at = {}});
  EXPECT_EQ(progress().state, State::proposed);
}

TEST_F(RimRun, PassesOverWhatDoesNotFollow) {
  goOn(2, 0.02, false, 9);
  goOn(3, 0.02, false);
  goOn(2, 0.02, true);
  goOn(1, 0.02, false);
  EXPECT_EQ(progress().state, State::solving);
  EXPECT_EQ(progress().steps, 20U);
  for (std::uint8_t loop = 2; loop <= kMostRimLoops; ++loop) {
    goOn(loop, 0, false);
    touchAll();
  }
  goOn(kMostRimLoops + 1, 0, false);
  EXPECT_EQ(progress().steps, 60U);
  EXPECT_EQ(progress().state, State::solving);
}

// What was measured so far: the centres of the ball, in the last loop at +theta and -theta.
std::optional<Solved> next(const Procedure& procedure, double y_plus_mm, double y_minus_mm, double limit_mm) {
  RunDataset measured;
  auto& table = measured.dataset.tables.emplace_back(metrology::Table::withColumns(
      "readings", std::array<std::string_view, 4>{"loop", "C_rad_clockwise_from_plus_y", "x_mm", "y_mm"}));
  table.append({1, 0.7, 20, y_plus_mm});
  table.append({1, -0.7, -20, y_minus_mm});
  if (limit_mm > 0) measured.dataset.config["level_limit_mm"] = limit_mm;
  return nextLoop(kCentrelineBySteps, procedure.recording(), {}, {}, measured);
}

TEST_F(RimRun, IsTurnedByWhatIsLeftOfTheAngle) {
  const auto turned = next(procedure, 100, 101, 0);
  ASSERT_TRUE(turned);
  EXPECT_EQ(turned->loops, 2U);
  EXPECT_FALSE(turned->closes);
  EXPECT_NEAR(turned->c_zero_rad, std::atan(-1.0 / 40), 1e-12) << "(B26)";
  EXPECT_TRUE(next(procedure, 100, 100.0099, 0)->closes);
  EXPECT_FALSE(next(procedure, 100, 100.0101, 0)->closes) << "10 um";
  EXPECT_TRUE(next(procedure, 100, 100.0101, 0.02)->closes);
  EXPECT_FALSE(nextLoop(kCentreline, procedure.recording(), {}, {}, {}));
  RunDataset refused;
  refused.refusal = metrology::Refusal{"no-delay", ""};
  EXPECT_FALSE(nextLoop(kCentrelineBySteps, procedure.recording(), {}, {}, refused));
}

// C has stopped 1 mrad beside +theta, and says so: the ball is on the line.
TEST_F(RimRun, IsLevelWhereTheAnglesAsMeasuredSaySo) {
  RunDataset measured;
  auto& table = measured.dataset.tables.emplace_back(metrology::Table::withColumns(
      "readings", std::array<std::string_view, 4>{"loop", "C_rad_clockwise_from_plus_y", "x_mm", "y_mm"}));
  for (const double c_rad : {0.701, -0.7}) table.append({1, c_rad, 600 * std::sin(c_rad), 600 * std::cos(c_rad)});
  EXPECT_TRUE(nextLoop(kCentrelineBySteps, procedure.recording(), {}, {}, measured)->closes);
}

TEST_F(RimRun, IsClosedAfterFiveLoopsHoweverTheBallStands) {
  for (std::uint8_t loop = 2; loop <= kMostRimLoops; ++loop) {
    goOn(loop, 0.001 * loop, false);
    touchAll();
  }
  const auto closed = next(procedure, 100, 101, 0);
  ASSERT_TRUE(closed);
  EXPECT_TRUE(closed->closes);
  EXPECT_EQ(closed->loops, kMostRimLoops);
  EXPECT_EQ(closed->c_zero_rad, 0.005) << "which is the solver's to judge";
  goOn(kMostRimLoops, 0.005, true);
  touchAll();
  EXPECT_FALSE(next(procedure, 100, 101, 0)) << "all is done";
}

}  // namespace
}  // namespace probebox::procedure
