#pragma once
#include <optional>

#include "drivers/world/solid_ball.hpp"
#include "drivers/world/vector.hpp"

namespace probebox::world {

// Emulates a stylus ball that slides around the equator of a ball with friction: its deflection deviates from the
// normal by the friction angle, against the motion. Before that it sticks while the body moves on.
struct Slide {
  SolidBall ball{};
  double sense{1};        // 1: from X to Y
  double friction_rad{};  // arc tangent of the coefficient
  Vector3 from{};         // free stylus ball as it begins

  // Centre of the stylus ball for where it would be without contact, `elapsed_s` after the slide began. Nothing beyond
  // the surface, where contact is lost.
  std::optional<Vector3> heldAt(const Vector3& unheld, double elapsed_s) const;
};

}  // namespace probebox::world
