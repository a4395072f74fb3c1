#include "drivers/world/route.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace probebox::world {

void Route::add(SafePath path) {
  for (; !path.done(); path.pass()) add(path.next());
}

Route Route::within(const Place& place, const Vector3& from, const Vector3& to) {
  Route route;
  if (place.shape == Place::Shape::gap) {
    route.add(to);
  } else {
    route.add(SafePath{from, to, place.centre, place.keep_out_mm});
  }
  return route;
}

Route Route::up(const Place& place, const Vector3& from, double height_mm) {
  Route route;
  Vector3 aside = from;
  if (place.shape == Place::Shape::gap) {
    if (place.entrance_mm != Vector3{}) route.add(place.centre);
    aside = place.centre + place.entrance_mm;
  } else if (norm(from - place.centre) < place.keep_out_mm) {
    aside = place.centre + place.keep_out_mm * unit(from - place.centre);
  }
  route.add(aside);
  route.add({aside[0], aside[1], height_mm});
  return route;
}

Route Route::down(const Place& place, const Vector3& from, const Vector3& to) {
  Route route;
  if (place.shape == Place::Shape::beside) {
    const Vector3 aside = place.centre + place.keep_out_mm * unit(to - place.centre);
    route.add({aside[0], aside[1], from[2]});
    route.add(aside);
    route.add(to);
    return route;
  }
  const Vector3 entrance = place.centre + place.entrance_mm, above{entrance[0], entrance[1], from[2]};
  route.add(above);
  if (place.shape == Place::Shape::gap) {
    if (place.entrance_mm != Vector3{}) route.add(entrance);
    route.add(place.centre);
    route.add(to);
  } else {
    route.add(SafePath{above, to, place.centre, place.keep_out_mm});
  }
  return route;
}

namespace {

constexpr double kLongestStep = std::numbers::pi / 3;
constexpr double kOverTheTopFrom = 1.75;  // rad, a little more than a right angle
constexpr Vector3 kTop{0, 0, 1};

// The direction from the centre; the top for a place in the centre itself.
Vector3 directionOf(const Vector3& place, const Vector3& centre) {
  const Vector3 direction = unit(place - centre);
  return direction == Vector3{} ? kTop : direction;
}

double angleBetween(const Vector3& a, const Vector3& b) {
  return std::atan2(norm(cross(a, b)), dot(a, b));
}

}  // namespace

SafePath::SafePath(const Vector3& start, const Vector3& target, const Vector3& centre, double keep_out_mm) {
  if (start == target) return;
  // The middle of the longest chord touches the sphere that is kept out of; a hundredth more is for rounding.
  const double shell_mm = 1.01 * keep_out_mm / std::cos(kLongestStep / 2);
  const Vector3 from = directionOf(start, centre), to = directionOf(target, centre);
  add(centre + shell_mm * from);
  if (angleBetween(from, to) > kOverTheTopFrom) {
    addArc(from, kTop, centre, shell_mm);
    addArc(kTop, to, centre, shell_mm);
  } else {
    addArc(from, to, centre, shell_mm);
  }
  add(target);
}

void SafePath::addArc(const Vector3& from, const Vector3& to, const Vector3& centre, double shell_mm) {
  const double angle = angleBetween(from, to);
  Vector3 aside = unit(to - dot(from, to) * from);
  // Straight through the centre every way round is as long.
  if (std::sin(angle) < 1e-6) aside = unit(cross(from, std::abs(from[0]) < 0.5 ? Vector3{1, 0, 0} : Vector3{0, 1, 0}));
  const auto steps = static_cast<int>(std::ceil(angle / kLongestStep - 1e-9));
  for (int i = 1; i <= steps; ++i) {
    const double turned = angle * i / steps;
    add(centre + shell_mm * (std::cos(turned) * from + std::sin(turned) * aside));
  }
}

}  // namespace probebox::world
