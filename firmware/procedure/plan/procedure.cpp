#include "firmware/procedure/plan/procedure.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>

#include "protocol/units/angle.hpp"
#include "protocol/units/tolerances.hpp"

namespace probebox::procedure {
namespace {

bool standsIn(const Step& step, const std::array<double, 3>& angles_rad) {
  if (!step.turns) return true;
  for (std::size_t axis = 0; axis < angles_rad.size(); ++axis) {
    const double off = std::remainder(angles_rad[axis] - step.touch.rotary_angles_rad[axis], kTurn);
    if (!(std::abs(off) <= kPoseTolerance_rad)) return false;
  }
  return true;
}

// The pose as reported, less the whole turns by which a report is beside the wanted angle (359.98 degrees for 0). Where
// a report is the wanted angle to the digits of the control, it is the wanted angle.
std::array<double, 3> measuredPose(const Step& step, std::array<double, 3> angles_rad) {
  if (!step.turns) return angles_rad;
  for (std::size_t axis = 0; axis < angles_rad.size(); ++axis) {
    const double wanted_rad = step.touch.rotary_angles_rad[axis];
    angles_rad[axis] -= kTurn * std::round((angles_rad[axis] - wanted_rad) / kTurn);
    if (std::abs(angles_rad[axis] - wanted_rad) < kEchoedAngle_rad) angles_rad[axis] = wanted_rad;
  }
  return angles_rad;
}

// The tool of the step's number, or whichever carries the probe: any that is not to be measured itself.
bool holds(const Plan& plan, const Step& step, std::uint32_t tool) {
  if (step.touch.tool != 0) return tool == step.touch.tool;
  return plan.tool == 0 || tool != plan.tool;
}

// Around a ball as large as any datum sphere.
Nanoseconds scanTimeOf(const Step& step) {
  constexpr double kRadius_mm = 60;
  const double scan_s = kRadius_mm * std::abs(turnOf(step.touch.scan)) / step.touch.retract_speed_mm_s;
  return Nanoseconds{std::llround(1.5e9 * scan_s)};
}

// The machine may be slower than it was asked to be.
Nanoseconds timeoutOf(const Step& step) {
  if (step.kind == Kind::rest) return Procedure::kStepTimeout + Nanoseconds{std::llround(1.5e9 * step.touch.rest_s)};
  if (step.kind == Kind::scan) return Procedure::kStepTimeout + scanTimeOf(step);
  if (const auto& turn = step.touch.until_contact) {
    const double way_rad = std::abs(turn->to_rad - step.touch.rotary_angles_rad[2]);
    return Procedure::kStepTimeout + Nanoseconds{std::llround(3e9 * way_rad / turn->speed_rad_s)};
  }
  const double travel_s = step.touch.travel_mm / step.touch.retract_speed_mm_s;
  return Procedure::kStepTimeout + Nanoseconds{std::llround(1.5e9 * travel_s)};
}

std::array<double, kLinearAxes> offsetsOf(const Zeros& zeros) {
  std::array<double, kLinearAxes> offset_mm{};
  std::ranges::transform(zeros.offset_mm, offset_mm.begin(), [](const auto& known) { return known.value_or(0.0); });
  return offset_mm;
}

// Axes of which it counts where they are, and not only how far they went: an angle of a screw is that of a position.
std::array<bool, kLinearAxes> placesOf(const Plan& plan) {
  std::array<bool, kLinearAxes> places{};
  places.fill(plan.method->finds_a_place);
  for (const auto& step : std::span{plan.steps}.first(plan.step_count)) {
    for (std::size_t axis = 0; axis < kLinearAxes && step.touch.sweeps; ++axis)
      places[axis] = places[axis] || step.touch.outward_normal[axis] != 0;
  }
  return places;
}

bool isElsewhere(const std::optional<double>& from, const std::optional<double>& to, double least_mm) {
  return from.has_value() != to.has_value() || std::abs(from.value_or(0) - to.value_or(0)) > least_mm;
}

// Why positions about these zeros do not go together at this step.
capture::TouchFault whyApart(const Zeros& from, const Zeros& to, const Plan& plan, const Step& step) {
  constexpr double kLeast_mm = 1e-3;
  // No screw expands by more than 1 mm/m.
  constexpr double kLeastOfWarm_mm = 1;
  using capture::TouchFault;
  const auto places = placesOf(plan);
  const bool holds_screws = !step.touch.sweeps;
  for (std::size_t axis = 0; axis < kLinearAxes; ++axis) {
    const auto &before = from.offset_mm[axis], &after = to.offset_mm[axis];
    const bool is_warm = holds_screws && std::abs(to.extension_mm[axis]) > kLeast_mm;
    if (from.breaks[axis] != to.breaks[axis]) return TouchFault::zero_lost;
    if (places[axis] && isElsewhere(before, after, kLeast_mm)) return TouchFault::zero_lost;
    if (is_warm && isElsewhere(before, after, kLeastOfWarm_mm)) return TouchFault::zero_lost;
  }
  if (step.touch.until_contact && from.breaks_of_c != to.breaks_of_c) return TouchFault::zero_lost;
  return holds_screws && from.screw_results != to.screw_results ? TouchFault::screw_changed : TouchFault::none;
}

}  // namespace

std::optional<Error> whyNotNow(const Progress& progress, MarkerPhase phase) {
  if (phase != MarkerPhase::pass) {
    if (!progress.passing) return std::nullopt;
    return Error{"A dry run is at this step: pass the others too, to the first one again, or abort the run."};
  }
  if (progress.state == State::waiting && (progress.passing || progress.step == 0)) return std::nullopt;
  return Error{"A dry run comes before the first reading: abort the run, and start it again."};
}

void Procedure::start(const ProcedureStarted& started, const DelayActivated& delay, const Zeros& zeros) {
  // A run is given up by abort only, and the worker may still be reading the recording.
  const bool in_progress =
      progress_.state == State::waiting || progress_.state == State::running || progress_.state == State::solving;
  if (in_progress) return;
  const LiveMethod* method = methodNumbered(methods_, started.method);
  if (method == nullptr) return;
  // Whoever starts a run has looked at the probe's limit.
  if (validate(*method, started.options, std::numeric_limits<double>::infinity())) return;
  options_ = started.options;
  fill(plan_, *method, options_);
  takeReadings(plan_, probe_);
  capture_.clear(delay, offsetsOf(zeros));
  zeros_ = zeros;
  progress_ = Progress{};
  progress_.run = started.run;
  progress_.method = method;
  progress_.state = State::waiting;
  progress_.steps = static_cast<std::uint32_t>(plan_.step_count);
  progress_.loops = plan_.loops;
}

void Procedure::abort(const ProcedureAborted& aborted) {
  const bool active = progress_.state == State::waiting || progress_.state == State::running;
  if (!active || aborted.run != progress_.run) return;
  capture_.abandon();
  progress_.state = State::aborted;
}

void Procedure::mark(const Marker& marker, const TickMap& map, const Zeros& zeros) {
  if (marker.procedure != progress_.run || marker.step != progress_.step) {
    ++stray_markers_;
    return;
  }
  const bool is_active = progress_.state == State::waiting || progress_.state == State::running;
  const auto apart = is_active && progress_.method->calibrates
                         ? whyApart(zeros_, zeros, plan_, plan_.steps[progress_.step])
                         : capture::TouchFault::none;
  const bool are_apart = apart != capture::TouchFault::none;
  if (are_apart && !beginAnew(zeros, apart)) return;
  if (whyNotNow(progress_, marker.phase)) {
    ++stray_markers_;
  } else if (marker.phase == MarkerPhase::pass) {
    passStep();
  } else if (progress_.state == State::waiting && marker.phase == MarkerPhase::begin) {
    beginStep(marker);
  } else if (progress_.state == State::running && marker.phase == MarkerPhase::end) {
    if (!are_apart) return endStep(map);
    capture_.abandon();
    repeatStep(apart == capture::TouchFault::zero_lost ? capture::TouchFault::source_lost : apart);
  } else if (progress_.state == State::running && marker.phase == MarkerPhase::begin) {
    // The machine has started the step again: what was recorded so far is half a touch.
    beginStep(marker);
  } else if (progress_.state == State::running) {
    capture_.abandon();
    progress_.state = State::waiting;
  } else {
    ++stray_markers_;
  }
}

// Positions about other zeros do not go together with those that are kept. Returns false when the run is refused.
bool Procedure::beginAnew(const Zeros& zeros, capture::TouchFault apart) {
  const auto places = placesOf(plan_);
  bool are_known = true;
  for (std::size_t axis = 0; axis < kLinearAxes; ++axis)
    are_known = are_known && (!places[axis] || zeros.offset_mm[axis].has_value());
  const auto& kept = capture_.recording();
  if (!kept.touches().empty() || !kept.contacts().empty() || !are_known) {
    capture_.abandon();
    progress_.last_fault = apart;
    progress_.state = State::refused;
    return false;
  }
  zeros_ = zeros;
  capture_.setOffsets(offsetsOf(zeros));
  return true;
}

void Procedure::beginStep(const Marker& marker) {
  const Step& step = plan_.steps[marker.step];
  if (!standsIn(step, marker.rotary_angles_rad)) {
    capture_.abandon();
    return repeatStep(capture::TouchFault::wrong_pose);
  }
  if (!holds(plan_, step, marker.tool)) {
    capture_.abandon();
    return repeatStep(capture::TouchFault::wrong_tool);
  }
  const bool stands =
      step.kind == Kind::hold || step.kind == Kind::rest || step.kind == Kind::scan || step.kind == Kind::turn;
  if (stands && !marker.at_rest) {
    capture_.abandon();
    return repeatStep(capture::TouchFault::moved);
  }
  capture::TouchRequest touch = step.touch;
  touch.rotary_angles_rad = measuredPose(step, marker.rotary_angles_rad);
  capture_.begin(touch);
  progress_.state = State::running;
  step_begun_ = marker.at;
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

// After the last step the first one is asked for again, to be measured.
void Procedure::passStep() {
  progress_.step = (progress_.step + 1) % progress_.steps;
  progress_.passing = progress_.step != 0;
}

// A press that was too deep would be as deep again.
void Procedure::repeatStep(capture::TouchFault fault) {
  progress_.last_fault = fault;
  ++progress_.repeats;
  const bool ends = fault == capture::TouchFault::probe_clipped || progress_.repeats > kMostRepeats;
  progress_.state = ends ? State::refused : State::waiting;
}

void Procedure::advance(MonoTime now) {
  if (progress_.state != State::running || now - step_begun_ < timeoutOf(plan_.steps[progress_.step])) return;
  capture_.abandon();
  progress_.timed_out = true;
  repeatStep(capture::TouchFault::none);
}

void Procedure::solved(const Solved& solved) {
  if (progress_.state != State::solving || solved.run != progress_.run) return;
  if (solved.loops != 0) return goOn(solved);
  progress_.state = solved.refused ? State::refused : State::proposed;
  progress_.result_id = solved.result_id;
}

// The steps that are done stay as they are.
void Procedure::goOn(const Solved& solved) {
  const auto after = plan_.method->loops.after;
  const auto loops = after != nullptr ? after(plan_.loops, options_, solved) : std::nullopt;
  if (!loops) return;
  fill(plan_, *plan_.method, options_, *loops);
  takeReadings(plan_, probe_);
  progress_.steps = static_cast<std::uint32_t>(plan_.step_count);
  progress_.loops = *loops;
  progress_.state = State::waiting;
}

bool Procedure::takeReadyToSolve() {
  const bool ready = ready_to_solve_;
  ready_to_solve_ = false;
  return ready;
}

}  // namespace probebox::procedure
