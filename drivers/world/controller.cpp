#include "drivers/world/controller.hpp"

#include <cmath>

namespace probebox::world {
namespace {

// The box publishes its state a moment after it has answered a marker.
constexpr Nanoseconds kPublishing = std::chrono::milliseconds{500};

// A prompt that a machine can follow; anything else is not moved for.
bool canBeFollowed(const Prompt& prompt) {
  const auto isDirection = [](const Vector3& v) { return std::abs(norm(v) - 1) < 1e-6; };
  const auto isLength = [](double mm) { return mm > 0 && mm < 100; };
  return isDirection(prompt.outward_normal) && isDirection(prompt.retract_direction) &&
         dot(prompt.outward_normal, prompt.retract_direction) > 0 && isLength(prompt.overtravel_mm) &&
         isLength(prompt.clearance_mm) && prompt.nominal_speed_mm_s > 0 && std::isfinite(prompt.nominal_speed_mm_s);
}

}  // namespace

Controller::Controller(const ControllerConfig& config, Machine& machine, BoxLink& link)
    : config_{config}, machine_{machine}, link_{link}, asked_{MonoTime::min()} {}

void Controller::advance(MonoTime now) {
  now_ = now;
  refreshStatus();
  if (procedureHasGone()) return leave();
  switch (activity_) {
    case Activity::asking:
      return ask();
    case Activity::travelling:
      return travel(Activity::settling);
    case Activity::settling:
      if (elapsed(config_.settle)) post(MarkerPhase::begin, Activity::beginning);
      return;
    case Activity::beginning:
    case Activity::ending:
    case Activity::abandoning:
      return awaitAnswer();
    case Activity::approaching:
    case Activity::dwelling:
    case Activity::retracting:
    case Activity::recording:
      return touch();
    case Activity::withdrawing:
      return withdraw();
    case Activity::parking:
      return travel(Activity::asking);
  }
}

void Controller::enter(Activity activity) {
  activity_ = activity;
  entered_ = now_;
}

void Controller::refreshStatus() {
  if (question_open_) {
    if (const auto answer = link_.procedureStatus()) {
      status_ = answer;
      question_open_ = false;
    }
  }
  const Nanoseconds pause = question_open_ ? config_.resend_interval : config_.status_interval;
  if (asked_ == MonoTime::min() || now_ - asked_ >= pause) question();
}

void Controller::question() {
  link_.askProcedureStatus();
  asked_ = now_;
  question_open_ = true;
}

bool Controller::procedureHasGone() const {
  const bool busy =
      activity_ != Activity::asking && activity_ != Activity::withdrawing && activity_ != Activity::parking;
  if (!busy || !status_) return false;
  const bool measuring = status_->state == RunState::waiting || status_->state == RunState::running;
  return !measuring || status_->run != step_.run;
}

void Controller::leave() {
  const bool may_touch =
      activity_ == Activity::approaching || activity_ == Activity::dwelling || activity_ == Activity::retracting;
  ++abandoned_steps_;
  if (may_touch) return enter(Activity::withdrawing);
  park();
}

// Forgets what the box said before, so that the next answer is newer than all that was done until now.
void Controller::askAnew() {
  status_.reset();
  question();
  enter(Activity::asking);
}

void Controller::ask() {
  if (!status_) return;
  switch (status_->state) {
    case RunState::waiting:
      if (canBeFollowed(*status_)) follow(*status_);
      return;
    case RunState::running:
      // A step has begun that nobody does: its end was lost, or the answer to its begin.
      if (!elapsed(kPublishing)) return;
      step_ = *status_;
      ++abandoned_steps_;
      return post(MarkerPhase::abandon, Activity::abandoning);
    default:
      if (machine_.commandedPosition() != config_.park_mm) park();
  }
}

void Controller::follow(const Prompt& prompt) {
  step_ = prompt;
  startPath(onNormal(step_.clearance_mm));
  enter(Activity::travelling);
}

void Controller::travel(Activity then) {
  if (!machine_.atRest(now_)) return;
  if (path_.done()) return enter(then);
  machine_.traverseTo(path_.next(), now_);
  path_.pass();
}

void Controller::post(MarkerPhase phase, Activity waiting) {
  marker_ = Marker{.procedure = step_.run,
                   .step = step_.step,
                   .phase = phase,
                   .rotary_angles_rad = {},
                   .tool = config_.tool,
                   .nominal_speed_mm_s = step_.nominal_speed_mm_s,
                   .at_rest = machine_.atRest(now_),
                   .at = now_};
  link_.postMarker(marker_);
  posted_ = now_;
  enter(waiting);
}

void Controller::awaitAnswer() {
  if (const auto taken = link_.markerAnswer()) return answered(*taken);
  if (elapsed(config_.give_up)) {
    abandoned_steps_ += activity_ == Activity::ending ? 1 : 0;
    return askAnew();
  }
  if (now_ - posted_ < config_.resend_interval) return;
  link_.postMarker(marker_);
  posted_ = now_;
  ++resent_markers_;
}

void Controller::answered(bool taken) {
  if (activity_ == Activity::beginning && taken) {
    machine_.moveTo(onNormal(-step_.overtravel_mm), step_.nominal_speed_mm_s, now_);
    return enter(Activity::approaching);
  }
  if (activity_ == Activity::ending) ++(taken ? finished_steps_ : abandoned_steps_);
  askAnew();
}

void Controller::touch() {
  if (!machine_.atRest(now_)) return;
  if (activity_ == Activity::approaching) return enter(Activity::dwelling);
  if (activity_ == Activity::retracting) return enter(Activity::recording);
  if (activity_ == Activity::recording) {
    if (elapsed(config_.afterwards)) post(MarkerPhase::end, Activity::ending);
    return;
  }
  if (!elapsed(config_.dwell)) return;
  const double retract_mm = step_.overtravel_mm + step_.clearance_mm + config_.run_out_mm;
  machine_.moveTo(machine_.commandedPosition() + retract_mm * step_.retract_direction, step_.nominal_speed_mm_s, now_);
  enter(Activity::retracting);
}

void Controller::withdraw() {
  if (!machine_.atRest(now_)) return;
  const Vector3 outside = onNormal(step_.clearance_mm);
  if (machine_.commandedPosition() == outside) return park();
  machine_.moveTo(outside, step_.nominal_speed_mm_s, now_);
}

void Controller::park() {
  startPath(config_.park_mm);
  enter(Activity::parking);
}

void Controller::startPath(const Vector3& target) {
  path_ = SafePath{machine_.commandedPosition(), target, config_.nominal_centre_mm,
                   config_.nominal_effective_radius_mm + config_.safe_distance_mm};
}

Vector3 Controller::onNormal(double outside_mm) const {
  return config_.nominal_centre_mm + (config_.nominal_effective_radius_mm + outside_mm) * step_.outward_normal;
}

}  // namespace probebox::world
