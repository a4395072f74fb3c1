#include "drivers/world/solid_ball.hpp"

#include <cmath>

namespace probebox::world {

std::optional<Meeting> SolidBall::meet(const Move& way) const {
  const Vector3 from_centre = way.from - centre;
  const double half = dot(from_centre, way.direction);
  const double discriminant = half * half - dot(from_centre, from_centre) + reach_mm * reach_mm;
  if (discriminant <= 0) return std::nullopt;
  const double distance_mm = -half - std::sqrt(discriminant);
  return Meeting{.distance_mm = distance_mm, .normal = unit(way.at(distance_mm) - centre)};
}

}  // namespace probebox::world
