#include "drivers/world/slide.hpp"

#include <algorithm>
#include <cmath>

namespace probebox::world {

std::optional<Vector3> Slide::heldAt(const Vector3& unheld, double elapsed_s) const {
  // No slide is so slow that its ball still sticks then.
  constexpr double kSticking_s = 0.3;
  const Vector3 from_centre = unheld - ball.centre;
  const double distance_mm = norm(from_centre);
  if (distance_mm >= ball.reach_mm) return std::nullopt;
  double angle_rad = friction_rad;
  if (elapsed_s < kSticking_s)
    angle_rad = std::min(angle_rad, std::atan2(norm(unheld - from), ball.reach_mm - distance_mm));
  // In the triangle of both centres and the unheld ball, the friction angle is at the held one.
  const double aside_mm = ball.reach_mm * std::sin(angle_rad);
  if (aside_mm >= distance_mm) return std::nullopt;
  const double deflection_mm =
      ball.reach_mm * std::cos(angle_rad) - std::sqrt(distance_mm * distance_mm - aside_mm * aside_mm);
  const double behind_rad = std::asin(deflection_mm * std::sin(angle_rad) / distance_mm);
  const Vector3 outwards = unit(from_centre), forwards = sense * unit(cross({0, 0, 1}, outwards));
  return ball.centre + ball.reach_mm * (std::cos(behind_rad) * outwards - std::sin(behind_rad) * forwards);
}

}  // namespace probebox::world
