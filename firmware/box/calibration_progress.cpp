#include "firmware/box/calibration_progress.hpp"

namespace probebox::box {
namespace {

published::CalibrationState calibrationState(procedure::State state) {
  using published::CalibrationState;
  switch (state) {
    case procedure::State::idle:
      return CalibrationState::idle;
    case procedure::State::waiting:
    case procedure::State::running:
    case procedure::State::solving:
      return CalibrationState::running;
    case procedure::State::proposed:
      return CalibrationState::proposed;
    case procedure::State::refused:
      return CalibrationState::refused;
    case procedure::State::aborted:
      return CalibrationState::aborted;
  }
  return CalibrationState::idle;
}

published::StepNow stepOf(const procedure::Progress& progress, const procedure::Plan& plan) {
  published::StepNow now{.state = static_cast<std::uint8_t>(progress.state),
                         .repeats = progress.repeats,
                         .fault = static_cast<std::uint8_t>(progress.last_fault),
                         .timed_out = progress.timed_out};
  const bool to_be_done = progress.state == procedure::State::waiting || progress.state == procedure::State::running;
  if (!to_be_done || progress.step >= plan.step_count) return now;
  const auto& step = plan.steps[progress.step];
  now.present = true;
  now.kind = static_cast<std::uint8_t>(step.kind);
  now.feature = static_cast<std::uint8_t>(step.feature);
  now.b_moves = static_cast<std::uint8_t>(step.b_moves);
  now.turns = step.turns;
  now.ball = step.touch.ball;
  now.mount = step.touch.mount;
  now.tool = step.touch.tool;
  now.outward_normal = step.touch.outward_normal;
  now.retract_direction = step.touch.retract_direction;
  now.overtravel_mm = step.overtravel_mm;
  now.clearance_mm = step.clearance_mm;
  now.run_out_mm = procedure::kRunOut_mm;
  now.speed_mm_s = step.touch.retract_speed_mm_s;
  now.travel_mm = step.touch.travel_mm;
  now.shank_height_mm = step.touch.shank_height_mm;
  now.rest_s = step.touch.rest_s;
  now.scan = step.touch.scan;
  if (const auto& turn = step.touch.until_contact) {
    now.turn_line_rad = turn->line_rad;
    now.turn_to_rad = turn->to_rad;
    now.turn_speed_rad_s = turn->speed_rad_s;
  }
  now.angles_rad = step.touch.rotary_angles_rad;
  return now;
}

}  // namespace

published::CalibrationProgress calibrationOf(const procedure::Progress& progress, const procedure::Plan& plan,
                                             const published::DelayInForce& delay) {
  const bool in_force = progress.result_id != 0 && delay.result_id == progress.result_id;
  return {.calibration = in_force ? published::CalibrationState::accepted : calibrationState(progress.state),
          .calibration_method = progress.method != nullptr ? progress.method->number : std::uint16_t{0},
          .calibration_run = progress.run,
          .calibration_step = progress.step,
          .calibration_steps = progress.steps,
          .calibration_result_id = progress.result_id,
          .step = stepOf(progress, plan)};
}

}  // namespace probebox::box
