#include "drivers/world/controller.hpp"

#include <algorithm>
#include <cmath>
#include <span>

#include "board/describe/world.hpp"
#include "drivers/world/places.hpp"
#include "protocol/units/angle.hpp"

namespace probebox::world {
namespace {

// Returns whether the step moves one axis alone without contact.
bool movesOneAxis(StepKind kind) {
  return kind == StepKind::jog || kind == StepKind::sweep;
}

// Returns whether the stylus or the tool touches a surface in the step.
bool touches(StepKind kind) {
  return kind == StepKind::touch || kind == StepKind::in_out;
}

bool isPath(const ScanPath& scan) {
  const auto isArc = [](double rad) { return rad > 0 && rad < kTurn; };
  const auto isDepth = [](double mm) { return mm > 0 && mm < 10; };
  const auto arcs = std::span{scan.arcs_rad}.first(std::min<std::size_t>(scan.count, ScanPath::kMostArcs));
  return scan.count >= 1 && scan.count <= ScanPath::kMostArcs && std::ranges::all_of(arcs, isArc) &&
         std::ranges::all_of(scan.depths_mm, isDepth) && std::isfinite(scan.start_rad) && std::abs(scan.sense) == 1 &&
         (scan.chords || isArc(scan.ramp_rad));
}

// Returns whether a machine can follow the prompt; it does not move for others.
bool canBeFollowed(const Prompt& prompt) {
  const auto isDirection = [](const Vector3& v) { return std::abs(norm(v) - 1) < 1e-6; };
  const auto isLength = [](double mm) { return mm > 0 && mm < 100; };
  const auto isTravel = [](double mm) { return mm > 0 && mm < 1000; };
  const bool timed = prompt.nominal_speed_mm_s > 0 && std::isfinite(prompt.nominal_speed_mm_s);
  if (prompt.kind == StepKind::rest) return prompt.rest_s > 0 && prompt.rest_s < 3600;
  if (movesOneAxis(prompt.kind)) return isDirection(prompt.outward_normal) && isTravel(prompt.travel_mm) && timed;
  const bool turnable = std::isfinite(norm(prompt.rotary_angles_rad)) &&
                        (prompt.rotary_angles_rad[1] == 0 || prompt.b_moves != BMoves::nothing);
  const bool is_part = prompt.feature == StepFeature::part_ball || prompt.feature == StepFeature::second_part_ball;
  if (is_part && (prompt.ball < 1 || prompt.ball > board::WorldPartSpindle::kMostBalls)) return false;
  if (prompt.kind == StepKind::turn) {
    const bool turned = std::isfinite(prompt.turn_line_rad) && std::isfinite(prompt.turn_to_rad);
    return isDirection(prompt.outward_normal) && isTravel(prompt.travel_mm) && isLength(prompt.overtravel_mm) &&
           turnable && turned && prompt.turn_speed_rad_s > 0 && prompt.feature == StepFeature::part_ball;
  }
  if (prompt.kind == StepKind::hold)
    return isDirection(prompt.outward_normal) && prompt.travel_mm >= 0 && prompt.travel_mm < 10 && turnable && timed;
  if (prompt.kind == StepKind::scan)
    return prompt.feature == StepFeature::datum_sphere && isPath(prompt.scan) && isLength(prompt.clearance_mm) && timed;
  const bool approaches =
      prompt.approach_direction == Vector3{} ||
      (isDirection(prompt.approach_direction) && dot(prompt.outward_normal, prompt.approach_direction) < 0);
  const bool by_shank = prompt.shank_height_mm != 0;
  if (by_shank && (!isTravel(prompt.shank_height_mm) || prompt.kind != StepKind::touch)) return false;
  return isDirection(prompt.outward_normal) && isDirection(prompt.retract_direction) && approaches && turnable &&
         prompt.run_out_mm >= 0 && prompt.run_out_mm < 100 &&
         dot(prompt.outward_normal, prompt.retract_direction) > 0 && isLength(prompt.overtravel_mm) &&
         isLength(prompt.clearance_mm) && timed;
}

// The box publishes its state a moment after it has answered a marker.
constexpr Nanoseconds kPublishing = std::chrono::milliseconds{500};

bool isAtSecond(const Prompt& step) {
  return step.feature == StepFeature::second_part_ball;
}

// As the controller tells them: A B C, where C is that of the chuck of the step.
Vector3 anglesOf(const Pose& pose, const Prompt& step) {
  return {pose.a_rad, pose.head_rad != 0 ? pose.head_rad : pose.table_rad,
          isAtSecond(step) ? pose.second_c_rad : pose.c_rad};
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
    case Activity::rising:
      if (arrived()) turn();
      return;
    case Activity::turning:
      if (!machine_.atRest(now_) || change()) return;
      near_ = place();
      route_ = Route::down(*near_, machine_.commandedPosition(), beginning());
      return enter(Activity::travelling);
    case Activity::travelling:
      return travel(Activity::settling);
    case Activity::settling:
      if (!elapsed(config_.settle)) return;
      if (step_.kind == StepKind::scan) return enterScan();
      return post(MarkerPhase::begin, Activity::beginning);
    case Activity::entering:
    case Activity::scanning:
    case Activity::leaving:
      return scan();
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
      if (arrived()) level();
      return;
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
  const bool busy = activity_ != Activity::asking && activity_ != Activity::withdrawing &&
                    activity_ != Activity::parking && activity_ != Activity::leaving;
  if (!busy || !status_) return false;
  const bool measuring = status_->state == RunState::waiting || status_->state == RunState::running;
  return !measuring || status_->run != step_.run;
}

void Controller::leave() {
  const bool moves =
      activity_ == Activity::approaching || activity_ == Activity::dwelling || activity_ == Activity::retracting;
  const bool may_touch = pressing_ || (moves && (touches(step_.kind) || step_.kind == StepKind::turn));
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

// Only a box without a run behind it: one that has lost a reference since has to be homed by a person's decision.
void Controller::home() {
  // The box believes it of axes that it has seen standing for a while.
  constexpr Nanoseconds kAgain = std::chrono::milliseconds{500};
  if (!machine_.atRest(now_) || homed_ == MonoTime::min()) homed_ = now_;
  if (!config_.homes || status_->referenced || status_->run != 0 || now_ - homed_ < kAgain) return;
  link_.home(machine_.commandedPosition());
  homed_ = now_;
}

void Controller::ask() {
  if (!status_) return;
  home();
  switch (status_->state) {
    case RunState::waiting:
      if (canBeFollowed(*status_) && knows(*status_)) follow(*status_);
      return;
    case RunState::running:
      // A step has begun that nobody does: its end was lost, or the answer to its begin.
      if (!elapsed(kPublishing)) return;
      step_ = *status_;
      ++abandoned_steps_;
      return post(MarkerPhase::abandon, Activity::abandoning);
    default:
      if (machine_.commandedPosition() != config_.park_mm()) park();
  }
}

void Controller::follow(const Prompt& prompt) {
  step_ = prompt;
  if (step_.kind == StepKind::rest) return enter(Activity::settling);
  if (movesOneAxis(step_.kind)) {
    rise();
    route_.add(config_.park_mm());
    return enter(Activity::travelling);
  }
  // A shank never goes round a ball: that hangs in its way from above.
  if (near_ == place() && !mustTurn() && step_.shank_height_mm == 0) {
    route_ = Route::within(*near_, machine_.commandedPosition(), beginning());
    return enter(Activity::travelling);
  }
  rise();
  enter(Activity::rising);
}

// The features and axes that this controller has been shown.
bool Controller::knows(const Prompt& prompt) const {
  const auto& known = config_.known;
  if (prompt.b_moves == BMoves::table && !known.tilting_table) return false;
  if (prompt.b_moves == BMoves::head && !known.swivel_head) return false;
  const auto& turned = isAtSecond(prompt) && known.second_spindle ? *known.second_spindle : known.part_spindle;
  if (prompt.mount > 1 + turned.further_mounts.size()) return false;
  const auto& first = known.probe_spindle;
  const bool has_tool =
      prompt.tool == first.tool ||
      std::ranges::find(known.further_tools, prompt.tool, &board::WorldTool::number) != known.further_tools.end();
  if (prompt.tool != 0 && !has_tool) return false;
  if (prompt.shank_height_mm != 0) {
    const bool ball = prompt.feature == StepFeature::datum_sphere || prompt.feature == StepFeature::part_ball;
    if (!first.shank || prompt.tool != first.tool || !ball) return false;
  }
  switch (prompt.feature) {
    case StepFeature::datum_sphere:
      return true;
    case StepFeature::plates:
      return placeOf(config_, prompt, tool(), pose()).half_mm != Vector3{};
    case StepFeature::cylinder:
      return known.cylinder.has_value();
    case StepFeature::cube:
      return known.cube.has_value();
    case StepFeature::part_ball:
      return prompt.ball >= 1 && prompt.ball <= known.part_spindle.balls_mm.size();
    case StepFeature::second_part_ball:
      return known.second_spindle && prompt.ball >= 1 && prompt.ball <= known.second_spindle->balls_mm.size();
    case StepFeature::tool_setter:
      return known.tool_setter.has_value();
  }
  return false;
}

// B stands at zero wherever it moves nothing, and C turns one of the chucks: the other one stays.
Pose Controller::pose() const {
  const auto& [a, b, c] = step_.rotary_angles_rad;
  const bool second = isAtSecond(step_);
  return {.a_rad = a,
          .head_rad = step_.b_moves == BMoves::head ? b : 0,
          .table_rad = step_.b_moves == BMoves::table ? b : 0,
          .c_rad = second ? machine_.commandedPose().c_rad : c,
          .second_c_rad = second ? c : machine_.commandedPose().second_c_rad};
}

// A step that says nothing about it is done with the first.
std::uint32_t Controller::tool() const {
  return step_.tool != 0 ? step_.tool : config_.known.probe_spindle.tool;
}

bool Controller::mustTurn() const {
  return (step_.turns && machine_.commandedPose() != pose()) || machine_.tool() != tool() ||
         machine_.mount() != mount();
}

std::size_t Controller::mount() const {
  return step_.mount != 0 ? step_.mount : machine_.mount();
}

// In machine positions.
Place Controller::place() const {
  Prompt step = step_;
  step.mount = static_cast<std::uint16_t>(mount());
  return placeOf(config_, step, tool(), step_.turns ? pose() : machine_.commandedPose());
}

void Controller::rise() {
  const Vector3 here = machine_.commandedPosition();
  const double height_mm =
      std::max(freeHeight(config_, machine_.tool(), machine_.commandedPose()), freeHeight(config_, tool(), pose()));
  route_ = near_ ? Route::up(*near_, here, height_mm) : Route{};
  if (!near_) route_.add({here[0], here[1], height_mm});
  near_.reset();
}

void Controller::turn() {
  change();
  enter(Activity::turning);
}

// The next thing that has to be changed before the step: tool, mount of the balls, rotary axes. False when nothing is.
bool Controller::change() {
  if (!mustTurn()) return false;
  if (machine_.tool() != tool()) {
    machine_.takeTool(tool(), now_);
  } else if (machine_.mount() != mount()) {
    machine_.mountBalls(mount(), now_);
  } else {
    machine_.turnTo(pose(), now_);
  }
  return true;
}

bool Controller::arrived() {
  if (!machine_.atRest(now_)) return false;
  if (route_.done()) return true;
  machine_.traverseTo(route_.next(), now_);
  route_.pass();
  return false;
}

void Controller::travel(Activity then) {
  if (arrived()) enter(then);
}

void Controller::post(MarkerPhase phase, Activity waiting) {
  marker_ = Marker{.procedure = step_.run,
                   .step = step_.step,
                   .phase = phase,
                   .rotary_angles_rad = anglesOf(machine_.commandedPose(), step_),
                   .tool = machine_.tool(),
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
    return finish();
  }
  if (now_ - posted_ < config_.resend_interval) return;
  link_.postMarker(marker_);
  posted_ = now_;
  ++resent_markers_;
}

void Controller::answered(bool taken) {
  if (activity_ == Activity::beginning && taken) {
    if (step_.kind == StepKind::scan) return enter(Activity::scanning);
    if (step_.kind == StepKind::turn) return turnUntilContact();
    if (!touches(step_.kind)) return enter(Activity::dwelling);  // where it stands is recorded first
    approach();
    return enter(Activity::approaching);
  }
  if (activity_ == Activity::ending) ++(taken ? finished_steps_ : abandoned_steps_);
  finish();
}

// The skip input tells where the surface is, and the overtravel counts from there.
void Controller::approach() {
  if (config_.known.distance_probe) {  // meets nothing, so the way counts from where the surface ought to be
    depth_mm_ = step_.overtravel_mm;
    machine_.moveTo(outOfSurface(-depth_mm_), step_.nominal_speed_mm_s, now_);
    return;
  }
  const double search_mm = config_.safe_distance_mm;
  const bool met = machine_
                       .moveUntilContact(outOfSurface(-step_.overtravel_mm - search_mm), step_.nominal_speed_mm_s, now_,
                                         step_.overtravel_mm)
                       .has_value();
  depth_mm_ = step_.overtravel_mm + (met ? 0 : search_mm);
}

void Controller::touch() {
  if (!machine_.atRest(now_)) return;
  if (activity_ == Activity::approaching && (step_.kind == StepKind::touch || step_.kind == StepKind::turn))
    return enter(Activity::dwelling);
  const bool jogged = activity_ == Activity::approaching && movesOneAxis(step_.kind);
  if (activity_ == Activity::retracting || jogged) return enter(Activity::recording);
  if (activity_ == Activity::recording) {
    const Nanoseconds rest{std::llround(1e9 * step_.rest_s)};
    if (elapsed(config_.afterwards + rest)) post(MarkerPhase::end, Activity::ending);
    return;
  }
  if (activity_ == Activity::dwelling && !elapsed(config_.dwell())) return;
  if (step_.kind == StepKind::hold || step_.kind == StepKind::rest) return enter(Activity::recording);
  if (movesOneAxis(step_.kind)) {
    const Vector3 target = machine_.commandedPosition() + step_.travel_mm * step_.outward_normal;
    machine_.moveTo(target, step_.nominal_speed_mm_s, now_);
    return enter(Activity::approaching);
  }
  if (step_.kind == StepKind::turn) {
    machine_.turnTo(pose(), step_.turn_speed_rad_s, now_);
    return enter(Activity::retracting);
  }
  const double run_out_mm = step_.run_out_mm > 0 ? step_.run_out_mm : config_.run_out_mm;
  const double retract_mm = depth_mm_ + step_.clearance_mm + run_out_mm;
  machine_.moveTo(machine_.commandedPosition() + retract_mm * step_.retract_direction, step_.nominal_speed_mm_s, now_);
  enter(Activity::retracting);
}

// The skip input stops C, as soon as its drive can.
void Controller::turnUntilContact() {
  const Vector3& ball = config_.known.part_spindle.balls_mm.at(step_.ball - 1U);
  const double beyond_rad = step_.overtravel_mm / std::hypot(ball[0], ball[1]);
  machine_.turnUntilContact(step_.turn_to_rad, step_.turn_speed_rad_s, now_, beyond_rad);
  enter(Activity::approaching);
}

void Controller::withdraw() {
  if (!machine_.atRest(now_)) return;
  if (step_.kind == StepKind::turn) {
    if (machine_.commandedPose() == pose()) return park();
    machine_.turnTo(pose(), step_.turn_speed_rad_s, now_);
    return;
  }
  const Vector3 outside = pressing_ ? offSurface() : outOfSurface(step_.clearance_mm);
  if (norm(machine_.commandedPosition() - outside) < 1e-9) return park();
  machine_.moveTo(outside, step_.nominal_speed_mm_s, now_);
}

void Controller::park() {
  pressing_ = false;
  rise();
  const auto& [x, y, z] = config_.park_mm();
  // High enough to level the head there, which lowers the tip.
  Pose level = machine_.commandedPose();
  level.head_rad = 0;
  route_.add({x, y,
              std::max(freeHeight(config_, machine_.tool(), machine_.commandedPose()),
                       freeHeight(config_, machine_.tool(), level))});
  enter(Activity::parking);
}

// Table and head stay tilted no longer than that is needed, and the first tool comes back; then on to where the machine
// parks.
void Controller::level() {
  Pose pose = machine_.commandedPose();
  pose.head_rad = 0;
  pose.table_rad = 0;
  if (pose != machine_.commandedPose()) {
    machine_.turnTo(pose, now_);
  } else if (machine_.tool() != config_.known.probe_spindle.tool) {
    machine_.takeTool(config_.known.probe_spindle.tool, now_);
  } else if (machine_.commandedPosition() != config_.park_mm()) {
    machine_.traverseTo(config_.park_mm(), now_);
  } else {
    enter(Activity::asking);
  }
}

// Where the machine stands as the step begins.
Vector3 Controller::beginning() const {
  if (step_.kind == StepKind::turn) return place().centre;
  if (step_.kind != StepKind::hold) return outOfSurface(step_.clearance_mm);
  return place().centre + step_.travel_mm * step_.outward_normal;
}

// Where the stylus ball's centre is to meet the surface.
Vector3 Controller::surface() const {
  const Place at = place();
  const auto& n = step_.outward_normal;
  const Vector3 half{n[0] * at.half_mm[0], n[1] * at.half_mm[1], n[2] * at.half_mm[2]};
  if (at.shape == Place::Shape::block) return at.centre + half;
  if (at.shape == Place::Shape::gap) return at.centre - half;
  return at.centre + (at.keep_out_mm - config_.safe_distance_mm) * step_.outward_normal;
}

// On the way by which the surface is approached.
Vector3 Controller::outOfSurface(double distance_mm) const {
  const bool told = step_.approach_direction != Vector3{};
  return surface() + distance_mm * (told ? -step_.approach_direction : step_.retract_direction);
}

// Scans: onto the surface, along it in contact, and off it.

// Off the surface first.
void Controller::finish() {
  if (!pressing_) return askAnew();
  machine_.moveTo(offSurface(), step_.nominal_speed_mm_s, now_);
  enter(Activity::leaving);
}

void Controller::enterScan() {
  way_ = 0;
  scan_rad_ = step_.scan.start_rad;
  pressing_ = true;
  machine_.moveTo(onScan(step_.scan.depths_mm[0]), step_.nominal_speed_mm_s, now_);
  enter(Activity::entering);
}

void Controller::scan() {
  if (!machine_.atRest(now_)) {
    entered_ = now_;
    return;
  }
  if (activity_ == Activity::leaving) {
    pressing_ = false;
    return askAnew();
  }
  if (activity_ == Activity::entering) {
    if (elapsed(config_.dwell())) post(MarkerPhase::begin, Activity::beginning);
    return;
  }
  if (!nextWay()) enter(Activity::recording);
}

// Exact stops between the ways.
bool Controller::nextWay() {
  if (way_ >= waysOf(step_.scan)) return false;
  const ScanWay way = wayOf(step_.scan, way_++);
  scan_rad_ += way.turn_rad;
  if (way.is_arc) return machine_.slideRound(place().centre, way.turn_rad, step_.nominal_speed_mm_s, now_);
  return machine_.slideTo(onScan(way.to_depth_mm), step_.nominal_speed_mm_s, now_);
}

// Where the centre of the stylus ball is to be for a depth, from where the scan has come to.
Vector3 Controller::onScan(double depth_mm) const {
  const Place at = place();
  const double radius_mm = at.keep_out_mm - config_.safe_distance_mm - depth_mm;
  return at.centre + radius_mm * Vector3{std::cos(scan_rad_), std::sin(scan_rad_), 0};
}

Vector3 Controller::offSurface() const {
  const Place at = place();
  const double distance_mm = at.keep_out_mm - config_.safe_distance_mm + step_.clearance_mm;
  return at.centre + distance_mm * unit(machine_.commandedPosition() - at.centre);
}

}  // namespace probebox::world
