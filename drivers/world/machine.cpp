#include "drivers/world/machine.hpp"

#include <algorithm>
#include <cmath>
#include <span>

#include "protocol/units/angle.hpp"

namespace probebox::world {
Machine::Machine(const Config& config, std::uint64_t seed)
    : axes_{config.axes},
      part_point_{config.part_spindle.point_mm},
      part_axis_{unit(config.part_spindle.direction)},
      rotary_{config.rotary},
      probe_spindle_{config.probe_spindle},
      further_tools_{config.further_tools},
      head_{config.swivel_head.value_or(board::WorldSwivelHead{})},
      linear_errors_{config.linear_axes},
      axes_sway_{config, Vibrates::axes},
      body_sway_{config, Vibrates::body, config.axes.drift},
      motion_{config.axes.home_mm, config.axes.lost_motion_mm},
      commanded_mm_{config.axes.home_mm},
      reads_distances_{config.distance_probe.has_value()},
      solids_{config},
      stylus_{config, body_sway_},
      random_{seed, RandomStream::machine},
      mounts_{1 + std::max(config.part_spindle.further_mounts.size(),
                           config.second_spindle ? config.second_spindle->further_mounts.size() : 0)} {
  probe_spindle_.direction = unit(probe_spindle_.direction);
  head_.direction = unit(head_.direction);
  tool_ = toolOf(probe_spindle_.tool);
  stands_.a_rad = stopAt(0, rotary_.noise_rad);
  stands_.c_rad = stopAt(0, rotary_.noise_rad);
  if (config.tilting_table) stands_.table_rad = stopAt(0, rotary_.noise_rad);
  if (config.swivel_head) stands_.head_rad = stopAt(0, head_.noise_rad);
  if (config.second_spindle) stands_.second_c_rad = stopAt(0, rotary_.noise_rad);
  hold_ = holdAt(stands_, tool_);
  solids_.turnPart(stands_.part());
  standFrom(MonoTime::min());
}

// The part of a straight move after which something is met.
std::optional<double> Machine::shareUntilMet(const Move& move) const {
  if (hold_.touches_nothing || move.length_mm == 0) return std::nullopt;
  if (touching()) return 0;
  std::optional<double> share;
  forEachWay(move, [&](const Move& way) {
    const auto found = share ? std::nullopt : stylus_.meeting(way, 0, solids_, hold_);
    if (found) share = (way.profile_from_mm + found->distance_mm * way.profile_per_mm) / move.length_mm;
  });
  return share;
}

// Calls take() for the straight ways that the body makes in a straight move, in order: one, or more while slides rest
// until play is taken up. Over the way of a touch geometric errors have no curvature to speak of.
template <class Take>
void Machine::forEachWay(const Move& move, Take take) const {
  if (linear_errors_.none() && motion_.isRigid()) return take(move);
  motion_.forEachPart(move, [&](double from_mm, double to_mm) {
    const Vector3 from = bodyFor(motion_.slideOn(move, from_mm)), way = bodyFor(motion_.slideOn(move, to_mm)) - from;
    Move real = move;
    real.from = from;
    real.direction = unit(way);
    real.length_mm = norm(way);
    real.profile_from_mm = from_mm;
    real.profile_per_mm = (to_mm - from_mm) / real.length_mm;
    if (real.length_mm > 0) take(real);
  });
}

void Machine::carry(const Move& move) {
  forEachWay(move, [this](const Move& way) {
    if (hold_.touches_nothing && comesFromAside(way)) ++crashes_;
    stylus_.follow(way, solids_, hold_);
  });
}

bool Machine::moveTo(const Vector3& target_mm, double speed_mm_s, MonoTime now) {
  if (!atRest(now)) return false;
  commanded_mm_ = target_mm;
  const Vector3 reached_mm = drives_ ? drives_(target_mm, now) : target_mm;
  if (reached_mm == motion_.target()) return true;
  carry(motion_.append(reached_mm, limits(speed_mm_s), now));
  return true;
}

std::optional<Vector3> Machine::moveUntilContact(const Vector3& target_mm, double speed_mm_s, MonoTime now,
                                                 double beyond_mm) {
  const Vector3 from_mm = commanded_mm_, way_mm = target_mm - from_mm;
  const auto share =
      shareUntilMet(motion_.moveTo(drives_ ? drives_(target_mm, now) : target_mm, limits(speed_mm_s), now));
  const double until = share ? std::min(1.0, *share + beyond_mm / norm(way_mm)) : 1;
  if (!moveTo(from_mm + until * way_mm, speed_mm_s, now) || !share) return std::nullopt;
  return from_mm + *share * way_mm;
}

bool Machine::slideTo(const Vector3& target_mm, double speed_mm_s, MonoTime now) {
  if (!atRest(now)) return false;
  commanded_mm_ = target_mm;
  const Vector3 reached_mm = drives_ ? drives_(target_mm, now) : target_mm;
  if (reached_mm == motion_.target()) return true;
  const Vector3 body = bodyEnd(now);
  const double turns = cross(body + hold_.tip - solids_.sphere().centre, reached_mm - motion_.target())[2];
  motion_.append(reached_mm, limits(speed_mm_s), now);
  stylus_.slide({now, 0}, body, solids_.sphere(), std::copysign(1, turns));
  return true;
}

// The drives are off by as much all along it.
bool Machine::slideRound(const Vector3& centre_mm, double turn_rad, double speed_mm_s, MonoTime now) {
  if (!atRest(now)) return false;
  const Vector3 off_mm = motion_.target() - commanded_mm_, body = bodyEnd(now);
  const Arc commanded = arcFrom(commanded_mm_, centre_mm, turn_rad);
  commanded_mm_ = commanded.at(commanded.length_mm());
  motion_.appendArc(arcFrom(motion_.target(), centre_mm + off_mm, turn_rad), limits(speed_mm_s), now);
  stylus_.slide({now, 0}, body, solids_.sphere(), std::copysign(1, turn_rad));
  return true;
}

bool Machine::turnTo(const Pose& pose, double speed_rad_s, MonoTime now) {
  if (!atRest(now)) return false;
  if (pose == commanded_) return true;
  const MonoTime until = now + Nanoseconds{std::llround(1e9 * wayBetween(commanded_, pose) / speed_rad_s)};
  if (turnedInto() != nullptr) {
    turnTouching(pose, speed_rad_s, now, until);
    return true;
  }
  if (touching() || strikesOnTheWayTo(pose, now)) ++crashes_;
  turn(pose, now, until);
  return true;
}

// On, or back until the ball leaves the stylus. C stands as far off as it did.
void Machine::turnTouching(const Pose& pose, double speed_rad_s, MonoTime from, MonoTime until) {
  constexpr double kMost_mm = 3;  // that the stylus gives way
  const auto& into = *turnedInto();
  const double before_rad = into.beyond(commanded_.c_rad), after_rad = into.beyond(pose.c_rad);
  const double arm_mm = armOf(tipEnd(from));
  if (!turnsByC(pose) || arm_mm * after_rad > kMost_mm) ++crashes_;
  if (after_rad <= 0) stylus_.partedAt({from, before_rad / speed_rad_s}, before_rad > 0 ? speed_rad_s : 0);
  if (!turnsByC(pose)) return turn(pose, from, until);
  stands_.c_rad += pose.c_rad - commanded_.c_rad;
  standAt(pose, from, until);
}

bool Machine::turnsByC(const Pose& pose) const {
  Pose by_c = commanded_;
  by_c.c_rad = pose.c_rad;
  return pose == by_c;
}

// Distance from the part's axis.
double Machine::armOf(const Vector3& point) const {
  return norm(cross(part_axis_, point - part_point_));
}

void Machine::turn(const Pose& pose, MonoTime from, MonoTime until) {
  if (pose.a_rad != commanded_.a_rad) stands_.a_rad = stopAt(pose.a_rad, rotary_.noise_rad);
  if (pose.c_rad != commanded_.c_rad) stands_.c_rad = stopAt(pose.c_rad, rotary_.noise_rad);
  if (pose.second_c_rad != commanded_.second_c_rad) stands_.second_c_rad = stopAt(pose.second_c_rad, rotary_.noise_rad);
  if (pose.table_rad != commanded_.table_rad) stands_.table_rad = stopAt(pose.table_rad, rotary_.noise_rad);
  if (pose.head_rad != commanded_.head_rad) stands_.head_rad = stopAt(pose.head_rad, head_.noise_rad);
  standAt(pose, from, until);
}

// The true angles are known.
void Machine::standAt(const Pose& pose, MonoTime from, MonoTime until) {
  hold_ = holdAt(stands_, tool_);
  solids_.turnPart(stands_.part());
  standFrom(from);
  if (pose.c_rad != commanded_.c_rad) part_.append(pose.c_rad, from, until);
  turned_at_ = until;
  commanded_ = pose;
}

void Machine::follow(const Vector3& position_mm, MonoTime from, MonoTime until) {
  commanded_mm_ = position_mm;
  if (position_mm == motion_.target()) return;
  const double speed_mm_s = norm(position_mm - motion_.target()) / toSeconds(until - from);
  if (slidesTo(position_mm, speed_mm_s, from)) {
    motion_.append(position_mm, steady(speed_mm_s), from);
    return;
  }
  carry(motion_.append(position_mm, steady(speed_mm_s), from));
}

// A way along the datum sphere, within its surface, is a scan; a touch goes into it. What is slower is a correction,
// and says nothing of the sense.
bool Machine::slidesTo(const Vector3& position_mm, double speed_mm_s, MonoTime from) {
  constexpr double kAlong = 0.3, kSlowest_mm_s = 1;
  if (!touching() || turnedInto() != nullptr) return false;
  const SolidBall& sphere = solids_.sphere();
  const Vector3 body = bodyEnd(from), way = position_mm - motion_.target();
  const Vector3 outwards = unit(body + hold_.tip - sphere.centre);
  if (norm(bodyFor(position_mm) + hold_.tip - sphere.centre) >= sphere.reach_mm) return false;
  const bool begins = speed_mm_s > kSlowest_mm_s && std::abs(dot(unit(way), outwards)) < kAlong;
  if (!begins && !stylus_.slides()) return false;
  return stylus_.slide({from, 0}, body, sphere, std::copysign(1, cross(outwards, way)[2]));
}

void Machine::followPose(const Pose& pose, MonoTime from, MonoTime until) {
  if (pose == commanded_) return;
  const Pose before = commanded_;
  if (turnedInto() != nullptr) {
    turnTouching(pose, wayBetween(commanded_, pose) / toSeconds(until - from), from, until);
  } else if (!leadsPart(pose, from, until)) {
    if (touching() || strikesOnTheWayTo(pose, from)) ++crashes_;
    turn(pose, from, until);
  }
  led_from_ = before;
}

// A turn of C alone that goes on, or that meets the stylus: C stands as far off as it did, since it has not stopped.
// False where it is none, or runs into the stylus.
bool Machine::leadsPart(const Pose& pose, MonoTime from, MonoTime until) {
  constexpr double kFastest_mm_s = 20;  // that a control touches at
  if (!turnsByC(pose) || touching() || tool_.radius_mm || tool_.head) return false;
  const double way_rad = pose.c_rad - commanded_.c_rad, speed_rad_s = std::abs(way_rad) / toSeconds(until - from);
  Pose to = stands_;
  to.c_rad += way_rad;
  const bool goes_on = led_from_.c_rad != commanded_.c_rad && from <= turned_at_;
  const auto share = shareUntilContact(stands_, to, from);
  if (!(share ? armOf(tipEnd(from)) * speed_rad_s <= kFastest_mm_s : goes_on)) return false;
  if (share) {
    solids_.turnPart(between(stands_, to, *share).part());
    strike(commanded_.c_rad + *share * way_rad, {from, *share * toSeconds(until - from)}, std::copysign(1, way_rad),
           speed_rad_s);
  }
  stands_ = to;
  standAt(pose, from, until);
  return true;
}

// A ball of the part, which stands at its contact, meets the free stylus. Returns how much further it turns until the
// stylus gives way, by the lobes of the probe.
double Machine::strike(double c_rad, const Instant& at, double sense, double speed_rad_s) {
  const Vector3 tip = tipEnd(at.rounded());
  stylus_.struckAt(tip, normalAt(tip), at, hold_,
                   {.axis = part_axis_, .through = part_point_, .contact_rad = c_rad, .sense = sense}, speed_rad_s);
  return turnedInto()->contact_rad - c_rad;
}

bool Machine::followTool(std::uint32_t number, MonoTime from) {
  if (number == tool_.number) return true;
  if (!hasTool(number)) return false;
  change(toolOf(number));
  standFrom(from);
  return true;
}

bool Machine::turnUntilContact(double c_rad, double speed_rad_s, MonoTime now, double beyond_rad) {
  if (!atRest(now) || touching() || tool_.radius_mm || tool_.head) return false;
  const double way_rad = c_rad - commanded_.c_rad;
  Pose target = stands_;
  target.c_rad += way_rad;
  const auto share = shareUntilContact(stands_, target, now);
  const double contact_rad = share.value_or(1) * way_rad;
  const double on_rad = share ? std::copysign(std::min(beyond_rad, std::abs(way_rad - contact_rad)), way_rad) : 0;
  const double until_contact_s = std::abs(contact_rad) / speed_rad_s;
  const double met_at_rad = commanded_.c_rad + contact_rad;
  stands_.c_rad += contact_rad;
  solids_.turnPart(stands_.part());
  const double late_rad = share ? strike(met_at_rad, {now + Nanoseconds{std::llround(1e9 * until_contact_s)}, 0},
                                         std::copysign(1, way_rad), speed_rad_s)
                                : 0;
  const double further_rad = late_rad + on_rad;
  commanded_.c_rad = met_at_rad + further_rad;
  turned_at_ = now + Nanoseconds{std::llround(1e9 * std::abs(contact_rad + further_rad) / speed_rad_s)};
  part_.append(commanded_.c_rad, now, turned_at_);
  standFrom(now);
  stands_.c_rad += further_rad;
  return true;
}

// Where the last move ends, at that time.
Vector3 Machine::bodyEnd(MonoTime at) const {
  return bodyFor(motion_.slide()) + body_sway_.at(at);
}

// From the ball that is nearest, outwards.
Vector3 Machine::normalAt(const Vector3& tip) const {
  const BallCentres balls = solids_.ballCentres();
  const auto all = std::span{balls.centres}.first(balls.count);
  const auto nearest = std::ranges::min_element(all, {}, [&](const Vector3& centre) { return norm(tip - centre); });
  return unit(tip - *nearest);
}

// The part of the way from one pose to another after which a ball has come to the stylus.
std::optional<double> Machine::shareUntilContact(const Pose& from, const Pose& to, MonoTime now) const {
  constexpr double kStep_rad = 0.001;
  const Vector3 tip = tipEnd(now);
  const auto strikes = [&](double share) {
    return solids_.occupied(tip, between(from, to, share).part(), hold_.shank);
  };
  const int steps = std::max(1, static_cast<int>(std::ceil(wayBetween(from, to) / kStep_rad)));
  for (int k = 1; k <= steps; ++k) {
    double late = static_cast<double>(k) / steps;
    if (!strikes(late)) continue;
    double early = static_cast<double>(k - 1) / steps;
    // Forty halvings of a thousandth of a radian end below any encoder.
    for (int i = 0; i < 40; ++i) {
      const double middle = (early + late) / 2;
      (strikes(middle) ? late : early) = middle;
    }
    return early;
  }
  return std::nullopt;
}

bool Machine::takeTool(std::uint32_t number, MonoTime now) {
  constexpr Nanoseconds kChange = std::chrono::seconds{3};
  if (!atRest(now)) return false;
  if (number == tool_.number) return true;
  if (!hasTool(number)) return false;
  change(toolOf(number));
  standStillFor(kChange, now);
  return true;
}

void Machine::change(const board::WorldTool& tool) {
  if (touching()) ++crashes_;
  tool_ = tool;
  hold_ = holdAt(stands_, tool_);
}

bool Machine::mountBalls(std::size_t mount, MonoTime now) {
  constexpr Nanoseconds kChange = std::chrono::seconds{10};
  if (!atRest(now)) return false;
  if (mount == mount_) return true;
  if (!hasMount(mount)) return false;
  putInto(mount);
  standStillFor(kChange, now);
  return true;
}

bool Machine::followMount(std::size_t mount, MonoTime from) {
  if (mount == mount_) return true;
  if (!hasMount(mount)) return false;
  putInto(mount);
  standFrom(from);
  return true;
}

void Machine::putInto(std::size_t mount) {
  if (touching()) ++crashes_;
  mount_ = mount;
  solids_.mountBalls(mount);
  solids_.turnPart(stands_.part());
}

// Somebody changes something, and no axis may move.
void Machine::standStillFor(Nanoseconds duration, MonoTime now) {
  standFrom(now);
  turned_at_ = now + duration;
}

void Machine::standFrom(MonoTime since) {
  sensor_head_.stand({.since = since,
                      .head = tool_.head,
                      .centre = hold_.tip,
                      .turned = hold_.turned,
                      .balls = solids_.ballCentres()});
}

// The sensors stand about the ball like a cradle: it is free along their middle alone.
bool Machine::comesFromAside(const Move& move) const {
  constexpr double kAlong = 0.9;
  Move way = move;
  way.from = move.from + hold_.tip;
  const auto meeting = solids_.meet(way, 0);
  return meeting && dot(meeting->normal, hold_.turned * Vector3{0, 0, 1}) < kAlong;
}

double Machine::distanceAt(MonoTime at, double delay_s, double stand_off_mm) const {
  const Vector3 looks = hold_.turned * Vector3{0, 0, -1};
  Move ray;
  ray.from = bodyAt(at, delay_s) + hold_.tip - stand_off_mm * looks;
  ray.direction = looks;
  ray.length_mm = 2 * stand_off_mm;
  const auto met = solids_.meet(ray, 0);
  return met ? met->distance_mm : ray.length_mm;
}

// The first one for a number that is not there.
board::WorldTool Machine::toolOf(std::uint32_t number) const {
  const auto found = std::ranges::find(further_tools_, number, &board::WorldTool::number);
  if (found != further_tools_.end()) return *found;
  return {.number = probe_spindle_.tool,
          .offset_mm = probe_spindle_.stylus_offset_mm,
          .length_mm = probe_spindle_.stylus_length_mm,
          .shank = probe_spindle_.shank};
}

bool Machine::strikesOnTheWayTo(const Pose& pose, MonoTime now) const {
  constexpr double kStep_rad = 0.01;
  const Vector3 body = bodyEnd(now);
  const int steps = std::max(1, static_cast<int>(std::ceil(wayBetween(commanded_, pose) / kStep_rad)));
  for (int k = 0; k <= steps; ++k) {
    const Pose at = between(commanded_, pose, static_cast<double>(k) / steps);
    const Hold hold = holdAt(at, tool_);
    if (solids_.occupied(body + hold.tip, at.part(), hold.shank)) return true;
  }
  return false;
}

bool Machine::touching() const {
  const Contact* last = stylus_.contactCount() > 0 ? stylus_.contact(stylus_.contactCount() - 1) : nullptr;
  return last != nullptr && !last->end;
}

const TurnOfPart* Machine::turnedInto() const {
  if (!touching()) return nullptr;
  const auto& into = stylus_.contact(stylus_.contactCount() - 1)->turned_into;
  return into ? &*into : nullptr;
}

// The reference lies on the spindle's axis; the ball hangs below it. Positions count from where an ideal spindle in a
// level head would hold the ball of the first tool.
Hold Machine::holdAt(const Pose& pose, const board::WorldTool& tool) const {
  const auto& [x, y] = tool.offset_mm;
  const Vector3 from_axis{x, y, -tool.length_mm};
  const Vector3 hanging = rotation(probe_spindle_.direction, pose.a_rad) * from_axis;
  const Matrix3 swivelled = rotation(head_.direction, pose.head_rad);
  const Vector3 arm = hanging - head_.pivot_mm, swung = swivelled * arm - arm;
  Hold hold{.tip = hanging + swung + Vector3{0, 0, probe_spindle_.stylus_length_mm},
            .turned = swivelled * rotation(probe_spindle_.direction, pose.a_rad),
            .tool_radius_mm = tool.radius_mm,
            .nose = tool.nose,
            .touches_nothing = tool.head.has_value() || (reads_distances_ && !tool.radius_mm),
            .pre_travel = tool.length_mm / probe_spindle_.stylus_length_mm};
  if (const auto& shank = tool.shank) {
    const double length_mm = shank->to_mm - shank->from_mm;
    const Vector3 low{shank->offset_mm[0], shank->offset_mm[1], shank->from_mm - tool.length_mm};
    const Vector3 high = low + length_mm * Vector3{shank->lean[0], shank->lean[1], 1};
    hold.shank = Shank{.low = hold.turned * (low - from_axis),
                       .high = hold.turned * (high - from_axis),
                       .radius_mm = shank->radius_mm,
                       .lever = shank->lever};
  }
  return hold;
}

namespace {

double waveAt(const board::WorldWave& wave, double position_mm) {
  if (wave.amplitude_mm == 0) return 0;
  return wave.amplitude_mm * std::sin(kTurn * position_mm / wave.length_mm + wave.phase_rad);
}

}  // namespace

LinearErrors::LinearErrors(const board::WorldLinearAxes& config)
    : config_{config}, none_{config == board::WorldLinearAxes{}} {}

Vector3 LinearErrors::at(const Vector3& position) const {
  if (none_) return {};
  const auto& [x, y, z] = position;
  const auto& [ea0z_rad, eb0z_rad, ec0y_rad] = config_.squareness_rad;
  // Y is turned about Z, and Z about X and Y, against an X that is straight.
  Vector3 error{eb0z_rad * z - ec0y_rad * y, -ea0z_rad * z, 0};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    error[axis] += config_.scale[axis] * position[axis];
    for (std::size_t direction = 0; direction < 3; ++direction)
      error[direction] += waveAt(config_.waves[axis][direction], position[axis]);
  }
  return error;
}

}  // namespace probebox::world
