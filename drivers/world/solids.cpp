#include "drivers/world/solids.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace probebox::world {
namespace {

SolidBlock plateOf(const board::WorldPlates& plates, double side, double reach_mm) {
  const double outwards = plates.gap_mm / 2 + plates.thickness_mm / 2;
  const Vector3 centre = plates.middle_mm + Vector3{side * outwards, 0, 0};
  const Vector3 half{plates.thickness_mm / 2 + reach_mm, plates.width_mm / 2 + reach_mm,
                     plates.height_mm / 2 + reach_mm};
  return {centre - half, centre + half};
}

SolidBlock grown(const board::WorldToolSetter& setter, const Vector3& by_mm) {
  const Vector3 half = setter.half_width_mm + by_mm;
  return {setter.centre_mm - half, setter.centre_mm + half};
}

// A point from the axis, turned about it, with the errors that the axis has at that angle.
Vector3 turnedBy(const Vector3& direction, double angle_rad, const board::WorldAxisErrors& errors,
                 const Vector3& point) {
  const double cosine = std::cos(angle_rad) - 1, sine = std::sin(angle_rad);
  const Vector3 shift = cosine * errors.cosine_mm + sine * errors.sine_mm;
  const Vector3 tilt = cosine * errors.cosine_rad + sine * errors.sine_rad;
  return shift + rotation(unit(tilt), norm(tilt)) * (rotation(direction, angle_rad) * point);
}

// The first of all solids that a move meets.
struct Nearest {
  const Move& way;
  double from_mm;
  std::optional<Meeting> found{};

  void consider(const std::optional<Meeting>& meeting) {
    if (!meeting || meeting->distance_mm < from_mm || meeting->distance_mm >= way.length_mm) return;
    if (!found || meeting->distance_mm < found->distance_mm) found = meeting;
  }
};

}  // namespace

// The way enters the block where it is inside of all three pairs of faces for the first time.
std::optional<Meeting> SolidBlock::meet(const Move& way) const {
  double enter = -std::numeric_limits<double>::infinity(), leave = -enter;
  std::size_t face = 0;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const double speed = way.direction[axis], at = way.from[axis];
    if (std::abs(speed) < 1e-12) {
      if (at <= from[axis] || at >= to[axis]) return std::nullopt;
      continue;
    }
    const double one = (from[axis] - at) / speed, other = (to[axis] - at) / speed;
    if (std::min(one, other) > enter) enter = std::min(one, other), face = axis;
    leave = std::min(leave, std::max(one, other));
  }
  if (enter >= leave) return std::nullopt;
  Meeting meeting{.distance_mm = enter, .normal = {}};
  meeting.normal[face] = way.direction[face] > 0 ? -1 : 1;
  return meeting;
}

Solids::Solids(const Config& config)
    : spindle_{config.part_spindle},
      table_{config.tilting_table.value_or(board::WorldTiltingTable{})},
      sphere_radius_mm_{config.sphere.radius_mm},
      sphere_{config.sphere.centre_mm, config.sphere.radius_mm + config.sphere.stylus_ball_radius_mm},
      setter_{config.tool_setter} {
  spindle_.direction = unit(spindle_.direction);
  table_.direction = unit(table_.direction);
  const double reach_mm = config.sphere.stylus_ball_radius_mm;
  if (const auto& plates = config.plates) {
    plates_ = {plateOf(*plates, -1, reach_mm), plateOf(*plates, 1, reach_mm)};
    plate_count_ = plates_.size();
  }
  if (setter_) setter_for_stylus_ = grown(*setter_, {reach_mm, reach_mm, reach_mm});
  for (auto& ball : part_) ball.reach_mm = spindle_.ball_radius_mm + reach_mm;
  turnPart({});
}

Vector3 Solids::partPoint(const Vector3& at_zero, const PartPose& pose) const {
  const Vector3 on_level_table =
      spindle_.point_mm + turnedBy(spindle_.direction, pose.c_rad, spindle_.errors, at_zero - spindle_.point_mm);
  return table_.point_mm + turnedBy(table_.direction, pose.tilt_rad, table_.errors, on_level_table - table_.point_mm);
}

Vector3 Solids::ballAt(std::size_t ball, const PartPose& pose) const {
  const Vector3& as_described = spindle_.balls_mm[ball];
  const Vector3 at = mount_ > 1 ? inMount(spindle_.further_mounts.at(mount_ - 2), as_described) : as_described;
  return partPoint(spindle_.point_mm + at, pose);
}

void Solids::turnPart(const PartPose& pose) {
  for (std::size_t i = 0; i < spindle_.balls_mm.size(); ++i) part_[i].centre = ballAt(i, pose);
}

std::optional<Meeting> Solids::meet(const Move& way, double from_mm, const std::optional<Shank>& shank) const {
  Nearest nearest{way, from_mm};
  nearest.consider(metBy(way, setter_for_stylus_));
  nearest.consider(sphere_.meet(way));
  for (std::size_t i = 0; i < plate_count_; ++i) nearest.consider(plates_[i].meet(way));
  for (std::size_t i = 0; i < spindle_.balls_mm.size(); ++i) nearest.consider(part_[i].meet(way));
  if (!shank) return nearest.found;
  nearest.consider(shank->meet(way, sphere_.centre, sphere_radius_mm_));
  for (std::size_t i = 0; i < spindle_.balls_mm.size(); ++i)
    nearest.consider(shank->meet(way, part_[i].centre, spindle_.ball_radius_mm));
  return nearest.found;
}

std::optional<Meeting> Solids::meetTool(const Move& way, double from_mm, double radius_mm, bool nose) const {
  Nearest nearest{way, from_mm};
  // The tip ends the tool, which stands above it; the nose of a turning tool is a ball about it.
  if (setter_) nearest.consider(metBy(way, grown(*setter_, {radius_mm, radius_mm, nose ? radius_mm : 0})));
  return nearest.found;
}

std::optional<Meeting> Solids::metBy(const Move& way, const SolidBlock& setter) const {
  auto meeting = setter_ ? setter.meet(way) : std::nullopt;
  if (meeting) meeting->setter = true;
  return meeting;
}

BallCentres Solids::ballCentres() const {
  BallCentres balls{.centres = {sphere_.centre}, .count = 1 + spindle_.balls_mm.size()};
  for (std::size_t i = 0; i < spindle_.balls_mm.size(); ++i) balls.centres[1 + i] = part_[i].centre;
  return balls;
}

bool Solids::occupied(const Vector3& point, const PartPose& pose, const std::optional<Shank>& shank) const {
  const auto struck = [&](const Vector3& ball, double reach_mm, double radius_mm) {
    return norm(point - ball) < reach_mm || (shank && shank->strikes(point, ball, radius_mm));
  };
  if (struck(sphere_.centre, sphere_.reach_mm, sphere_radius_mm_)) return true;
  for (std::size_t i = 0; i < spindle_.balls_mm.size(); ++i) {
    if (struck(ballAt(i, pose), part_[i].reach_mm, spindle_.ball_radius_mm)) return true;
  }
  return false;
}

namespace {

Vector3 across(const Vector3& v, const Vector3& axis) {
  return v - dot(v, axis) * axis;
}

// Where the ball comes to the cylinder between its ends.
std::optional<Meeting> meetSide(const Move& way, const Vector3& low, const Vector3& high, const Vector3& ball,
                                double reach_mm) {
  const Vector3 axis = unit(high - low);
  const Vector3 from_ball = across(way.from + low - ball, axis), going = across(way.direction, axis);
  const double speed = dot(going, going), half = dot(from_ball, going);
  const double discriminant = half * half - speed * (dot(from_ball, from_ball) - reach_mm * reach_mm);
  if (speed < 1e-12 || discriminant <= 0) return std::nullopt;
  const double distance_mm = (-half - std::sqrt(discriminant)) / speed;
  const double height_mm = dot(ball - (way.at(distance_mm) + low), axis);
  if (height_mm < 0 || height_mm > norm(high - low)) return std::nullopt;
  return Meeting{.distance_mm = distance_mm, .normal = unit(from_ball + distance_mm * going)};
}

std::optional<Meeting> meetEnd(Move way, const Vector3& end, const Vector3& ball, double reach_mm) {
  way.from = way.from + end;
  return SolidBall{ball, reach_mm}.meet(way);
}

}  // namespace

std::optional<Meeting> Shank::meet(const Move& way, const Vector3& ball, double ball_radius_mm) const {
  const double reach_mm = ball_radius_mm + radius_mm;
  std::optional<Meeting> first;
  for (auto meeting : {meetSide(way, low, high, ball, reach_mm), meetEnd(way, low, ball, reach_mm),
                       meetEnd(way, high, ball, reach_mm)}) {
    if (meeting && (!first || meeting->distance_mm < first->distance_mm)) first = meeting;
  }
  if (first) first->lever = lever;
  return first;
}

bool Shank::strikes(const Vector3& tip, const Vector3& ball, double ball_radius_mm) const {
  const Vector3 from = ball - (tip + low), length = high - low;
  const double share = std::clamp(dot(from, length) / dot(length, length), 0.0, 1.0);
  return norm(from - share * length) < ball_radius_mm + radius_mm;
}

std::optional<Meeting> SolidBall::meet(const Move& way) const {
  const Vector3 from_centre = way.from - centre;
  const double half = dot(from_centre, way.direction);
  const double discriminant = half * half - dot(from_centre, from_centre) + reach_mm * reach_mm;
  if (discriminant <= 0) return std::nullopt;
  const double distance_mm = -half - std::sqrt(discriminant);
  return Meeting{.distance_mm = distance_mm, .normal = unit(way.at(distance_mm) - centre)};
}

}  // namespace probebox::world
