// The step to do next, as a controller without a screen reads it: all that the plan says of it.
#include "firmware/box/calibration_progress.hpp"

#include <gtest/gtest.h>
#include <memory>

namespace probebox::box {
namespace {

using published::CalibrationState;

// No two values are equal, and none is that of an empty step.
std::unique_ptr<procedure::Plan> planOfOneStep() {
  auto plan = std::make_unique<procedure::Plan>();
  capture::TouchRequest touch{.outward_normal = {0.1, 0.2, 0.3}, .retract_direction = {0.4, 0.5, 0.6}};
  touch.retract_speed_mm_s = 7;
  touch.rotary_angles_rad = {0.8, 0.9, 1.1};
  touch.ball = 12;
  touch.tool = 13;
  touch.travel_mm = 14;
  touch.rest_s = 15;
  touch.shank_height_mm = 16;
  touch.mount = 17;
  touch.scan.count = 3;
  touch.scan.start_rad = 1.8;
  touch.until_contact = capture::TurnOfC{.line_rad = 1.9, .to_rad = 2.1, .speed_rad_s = 2.2};
  plan->step_count = 2;
  plan->steps[1] = {.touch = touch,
                    .feature = procedure::Feature::part_ball,
                    .kind = procedure::Kind::in_out,
                    .turns = true,
                    .b_moves = procedure::BMoves::head,
                    .overtravel_mm = 2.3,
                    .clearance_mm = 2.4};
  return plan;
}

procedure::Progress running() {
  return {.run = 5,
          .state = procedure::State::running,
          .step = 1,
          .steps = 2,
          .repeats = 3,
          .last_fault = capture::TouchFault::source_lost,
          .timed_out = true};
}

TEST(CalibrationProgress, HasAllThatThePlanSaysOfTheStep) {
  const auto plan = planOfOneStep();
  const auto& touch = plan->steps[1].touch;
  const auto told = calibrationOf(running(), *plan, {});
  EXPECT_EQ(told.calibration, CalibrationState::running);
  EXPECT_EQ(told.calibration_run, 5U);
  EXPECT_EQ(told.calibration_step, 1U);
  EXPECT_EQ(told.calibration_steps, 2U);
  const auto& step = told.step;
  EXPECT_TRUE(step.present);
  EXPECT_EQ(step.state, RunState::running);
  EXPECT_EQ(step.kind, StepKind::in_out);
  EXPECT_EQ(step.feature, StepFeature::part_ball);
  EXPECT_EQ(step.b_moves, BMoves::head);
  EXPECT_TRUE(step.turns);
  EXPECT_EQ(step.ball, touch.ball);
  EXPECT_EQ(step.mount, touch.mount);
  EXPECT_EQ(step.tool, touch.tool);
  EXPECT_EQ(step.outward_normal, touch.outward_normal);
  EXPECT_EQ(step.retract_direction, touch.retract_direction);
  EXPECT_EQ(step.overtravel_mm, 2.3);
  EXPECT_EQ(step.clearance_mm, 2.4);
  EXPECT_EQ(step.run_out_mm, procedure::kRunOut_mm);
  EXPECT_EQ(step.nominal_speed_mm_s, touch.retract_speed_mm_s);
  EXPECT_EQ(step.travel_mm, touch.travel_mm);
  EXPECT_EQ(step.shank_height_mm, touch.shank_height_mm);
  EXPECT_EQ(step.rest_s, touch.rest_s);
  EXPECT_EQ(step.scan.count, touch.scan.count);
  EXPECT_EQ(step.scan.start_rad, touch.scan.start_rad);
  EXPECT_EQ(step.turn_line_rad, 1.9);
  EXPECT_EQ(step.turn_to_rad, 2.1);
  EXPECT_EQ(step.turn_speed_rad_s, 2.2);
  EXPECT_EQ(step.rotary_angles_rad, touch.rotary_angles_rad);
  EXPECT_EQ(step.repeats, 3U);
  EXPECT_EQ(step.fault, static_cast<std::uint8_t>(capture::TouchFault::source_lost));
  EXPECT_TRUE(step.timed_out);
}

TEST(CalibrationProgress, HasNoStepBehindTheLastOne) {
  const auto plan = planOfOneStep();
  auto progress = running();
  progress.step = 2;
  EXPECT_FALSE(calibrationOf(progress, *plan, {}).step.present);
  progress.step = 1;
  for (const auto state : {procedure::State::idle, procedure::State::solving, procedure::State::proposed,
                           procedure::State::refused, procedure::State::aborted}) {
    progress.state = state;
    EXPECT_FALSE(calibrationOf(progress, *plan, {}).step.present);
  }
}

TEST(CalibrationProgress, IsAcceptedOnceItsDelayIsInForce) {
  const auto plan = planOfOneStep();
  auto progress = running();
  progress.state = procedure::State::proposed;
  EXPECT_EQ(calibrationOf(progress, *plan, {}).calibration, CalibrationState::proposed) << "without a result";
  progress.result_id = 41;
  published::DelayInForce delay;
  delay.result_id = 40;
  EXPECT_EQ(calibrationOf(progress, *plan, delay).calibration, CalibrationState::proposed);
  delay.result_id = 41;
  EXPECT_EQ(calibrationOf(progress, *plan, delay).calibration, CalibrationState::accepted);
  EXPECT_EQ(calibrationOf(progress, *plan, delay).calibration_result_id, 41U);
}

}  // namespace
}  // namespace probebox::box
