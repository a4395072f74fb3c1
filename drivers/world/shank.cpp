#include "drivers/world/shank.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "drivers/world/solid_ball.hpp"

namespace probebox::world {
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

}  // namespace probebox::world
