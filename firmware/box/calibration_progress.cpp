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
  const bool to_be_done = progress.state == RunState::waiting || progress.state == RunState::running;
  const bool present = to_be_done && progress.step < plan.step_count;
  return {present ? procedure::asked(plan.steps[progress.step]) : Step{},
          present,
          progress.state,
          progress.repeats,
          static_cast<std::uint8_t>(progress.last_fault),
          progress.timed_out};
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
