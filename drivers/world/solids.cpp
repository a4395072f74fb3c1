#include "drivers/world/solids.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace probebox::world {
namespace {

SolidBlock blockOf(const Vector3& middle, const Vector3& size_mm, double reach_mm) {
  const Vector3 half = 0.5 * size_mm + Vector3{reach_mm, reach_mm, reach_mm};
  return {middle - half, middle + half};
}

SolidBlock plateOf(const board::WorldPlates& plates, std::size_t axis, double side, double reach_mm) {
  Vector3 middle = plates.middle_mm;
  middle[axis] += side * (plates.gap_mm / 2 + plates.thickness_mm / 2);
  return blockOf(middle, plates.sizeAcross(axis), reach_mm);
}

SolidRing ringOf(const board::WorldCylinder& cylinder, double reach_mm) {
  const double radius_mm = cylinder.diameter_mm / 2;
  SolidRing ring{.middle = cylinder.middle_mm,
                 .outer_mm = radius_mm + cylinder.wall_mm + reach_mm,
                 .half_height_mm = cylinder.height_mm / 2 + reach_mm};
  if (cylinder.isBore()) ring.inner_mm = radius_mm - reach_mm;
  return ring;
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

std::optional<Meeting> SolidRing::meet(const Move& way, double from_mm) const {
  std::optional<Meeting> first;
  const auto consider = [&](double distance_mm, const Vector3& normal) {
    const Vector3 off = way.at(distance_mm) - middle;
    const double radius_mm = std::hypot(off[0], off[1]);
    constexpr double kOnIt_mm = 1e-9;
    const bool on_it = radius_mm > inner_mm - kOnIt_mm && radius_mm < outer_mm + kOnIt_mm &&
                       std::abs(off[2]) < half_height_mm + kOnIt_mm;
    if (!on_it || distance_mm < from_mm || dot(way.direction, normal) >= 0) return;
    if (!first || distance_mm < first->distance_mm) first = Meeting{.distance_mm = distance_mm, .normal = normal};
  };
  const auto& [x, y, z] = way.direction;
  const Vector3 off = way.from - middle;
  const double along = x * x + y * y, half = off[0] * x + off[1] * y;
  for (const double radius_mm : {inner_mm, outer_mm}) {
    const double discriminant = half * half - along * (off[0] * off[0] + off[1] * off[1] - radius_mm * radius_mm);
    if (along < 1e-12 || radius_mm == 0 || discriminant <= 0) continue;
    for (const double root : {-1.0, 1.0}) {
      const double distance_mm = (-half + root * std::sqrt(discriminant)) / along;
      const Vector3 at = way.at(distance_mm) - middle;
      consider(distance_mm, (radius_mm == inner_mm ? -1.0 : 1.0) * unit(Vector3{at[0], at[1], 0}));
    }
  }
  for (const double side : {-1.0, 1.0}) {
    if (std::abs(z) > 1e-12) consider((side * half_height_mm - off[2]) / z, {0, 0, side});
  }
  return first;
}

Solids::Solids(const Config& config)
    : spindle_{config.part_spindle},
      second_{config.second_spindle.value_or(board::WorldPartSpindle{})},
      table_{config.tilting_table.value_or(board::WorldTiltingTable{})},
      sphere_radius_mm_{config.sphere.radius_mm},
      sphere_{config.sphere.centre_mm, config.sphere.radius_mm + config.sphere.stylus_ball_radius_mm},
      setter_{config.tool_setter} {
  spindle_.direction = unit(spindle_.direction);
  second_.direction = unit(second_.direction);
  table_.direction = unit(table_.direction);
  const double reach_mm = config.sphere.stylus_ball_radius_mm;
  for (std::size_t axis = 0; axis < config.plates.size(); ++axis) {
    const auto& plates = config.plates[axis];
    if (!plates) continue;
    for (const double side : {-1.0, 1.0}) blocks_.at(block_count_++) = plateOf(*plates, axis, side, reach_mm);
  }
  if (const auto& cube = config.cube) blocks_.at(block_count_++) = blockOf(cube->middle_mm, cube->edges_mm, reach_mm);
  if (config.cylinder) ring_ = ringOf(*config.cylinder, reach_mm);
  if (setter_) setter_for_stylus_ = grown(*setter_, {reach_mm, reach_mm, reach_mm});
  for (std::size_t i = 0; i < ballCount(); ++i) part_[i].reach_mm = radiusOf(i) + reach_mm;
  turnPart({});
}

Vector3 Solids::partPoint(const Vector3& at_zero, const PartPose& pose) const {
  const Vector3 on_level_table =
      spindle_.point_mm + turnedBy(spindle_.direction, pose.c_rad, spindle_.errors, at_zero - spindle_.point_mm);
  return table_.point_mm + turnedBy(table_.direction, pose.tilt_rad, table_.errors, on_level_table - table_.point_mm);
}

Vector3 Solids::ballAt(std::size_t ball, const PartPose& pose) const {
  const std::size_t of_first = spindle_.balls_mm.size();
  const bool second = ball >= of_first;
  const auto& spindle = second ? second_ : spindle_;
  Vector3 at = spindle.balls_mm[second ? ball - of_first : ball];
  if (mount_ > 1 && mount_ - 2 < spindle.further_mounts.size()) at = inMount(spindle.further_mounts[mount_ - 2], at);
  if (second) return spindle.point_mm + turnedBy(spindle.direction, pose.second_c_rad, spindle.errors, at);
  return partPoint(spindle.point_mm + at, pose);
}

void Solids::turnPart(const PartPose& pose) {
  for (std::size_t i = 0; i < ballCount(); ++i) part_[i].centre = ballAt(i, pose);
}

std::optional<Meeting> Solids::meet(const Move& way, double from_mm, const std::optional<Shank>& shank) const {
  Nearest nearest{way, from_mm};
  nearest.consider(metBy(way, setter_for_stylus_));
  nearest.consider(sphere_.meet(way));
  for (std::size_t i = 0; i < block_count_; ++i) nearest.consider(blocks_[i].meet(way));
  if (ring_) nearest.consider(ring_->meet(way, from_mm));
  for (std::size_t i = 0; i < ballCount(); ++i) nearest.consider(part_[i].meet(way));
  if (!shank) return nearest.found;
  nearest.consider(shank->meet(way, sphere_.centre, sphere_radius_mm_));
  for (std::size_t i = 0; i < ballCount(); ++i) nearest.consider(shank->meet(way, part_[i].centre, radiusOf(i)));
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
  BallCentres balls{.centres = {sphere_.centre}, .count = 1 + ballCount()};
  for (std::size_t i = 0; i < ballCount(); ++i) balls.centres[1 + i] = part_[i].centre;
  return balls;
}

bool Solids::occupied(const Vector3& point, const PartPose& pose, const std::optional<Shank>& shank) const {
  const auto struck = [&](const Vector3& ball, double reach_mm, double radius_mm) {
    return norm(point - ball) < reach_mm || (shank && shank->strikes(point, ball, radius_mm));
  };
  if (struck(sphere_.centre, sphere_.reach_mm, sphere_radius_mm_)) return true;
  for (std::size_t i = 0; i < ballCount(); ++i) {
    if (struck(ballAt(i, pose), part_[i].reach_mm, radiusOf(i))) return true;
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
