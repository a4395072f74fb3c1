#include "firmware/procedure/procedure.hpp"

namespace probebox::procedure {

Procedure::Procedure(const MultiSpeedOptions& options, capture::Capacity capacity)
    : plan_{planMultiSpeed(options)}, capture_{capacity} {}

void Procedure::start(const ProcedureStarted& started) {
  // A run is given up by abort only, and the worker may still be reading the recording.
  const bool in_progress =
      progress_.state == State::waiting || progress_.state == State::running || progress_.state == State::solving;
  if (in_progress || started.method != static_cast<std::uint16_t>(plan_.method)) return;
  capture_.clear();
  progress_ = Progress{};
  progress_.run = started.run;
  progress_.method = plan_.method;
  progress_.state = State::waiting;
  progress_.steps = static_cast<std::uint32_t>(plan_.step_count);
}

void Procedure::abort(const ProcedureAborted& aborted) {
  const bool active = progress_.state == State::waiting || progress_.state == State::running;
  if (!active || aborted.run != progress_.run) return;
  capture_.abandon();
  progress_.state = State::aborted;
}

void Procedure::mark(const Marker& marker, const TickMap& map) {
  if (marker.procedure != progress_.run || marker.step != progress_.step) {
    ++stray_markers_;
    return;
  }
  if (progress_.state == State::waiting && marker.phase == MarkerPhase::begin) {
    capture_.begin(plan_.steps[marker.step].touch);
    progress_.state = State::running;
    step_begun_ = marker.at;
  } else if (progress_.state == State::running && marker.phase == MarkerPhase::end) {
    endStep(map);
  } else if (progress_.state == State::running && marker.phase == MarkerPhase::begin) {
    // The machine has started the step again: what was recorded so far is half a touch.
    capture_.begin(plan_.steps[marker.step].touch);
    step_begun_ = marker.at;
  } else if (progress_.state == State::running) {
    capture_.abandon();
    progress_.state = State::waiting;
  } else {
    ++stray_markers_;
  }
}

void Procedure::endStep(const TickMap& map) {
  if (const auto fault = capture_.end(map); fault != capture::TouchFault::none) {
    repeatStep(fault);
    return;
  }
  progress_.repeats = 0;
  progress_.last_fault = capture::TouchFault::none;
  progress_.timed_out = false;
  ++progress_.step;
  progress_.state = progress_.step == progress_.steps ? State::solving : State::waiting;
  ready_to_solve_ = progress_.state == State::solving;
}

void Procedure::repeatStep(capture::TouchFault fault) {
  progress_.last_fault = fault;
  ++progress_.repeats;
  progress_.state = progress_.repeats > kMostRepeats ? State::refused : State::waiting;
}

void Procedure::advance(MonoTime now) {
  if (progress_.state != State::running || now - step_begun_ < kStepTimeout) return;
  capture_.abandon();
  progress_.timed_out = true;
  repeatStep(capture::TouchFault::none);
}

void Procedure::solved(const Solved& solved) {
  if (progress_.state != State::solving || solved.run != progress_.run) return;
  progress_.state = solved.refused ? State::refused : State::proposed;
  progress_.result_id = solved.result_id;
}

bool Procedure::takeReadyToSolve() {
  const bool ready = ready_to_solve_;
  ready_to_solve_ = false;
  return ready;
}

}  // namespace probebox::procedure
