#pragma once
#include <optional>

#include "drivers/world/meeting.hpp"
#include "drivers/world/motion.hpp"
#include "drivers/world/vector.hpp"

namespace probebox::world {

// The shank above the stylus' ball as the machine holds it: a cylinder with round ends.
struct Shank {
  Vector3 low{}, high{};  // the ends of its axis, from the centre of the stylus' ball
  double radius_mm{};
  double lever{1};  // what the ball is moved by where the shank is moved by 1

  // Where a straight way of the stylus ball's centre brings the shank against a ball. A way that begins within meets it
  // where it would have come in, behind its beginning.
  std::optional<Meeting> meet(const Move& way, const Vector3& ball, double ball_radius_mm) const;
  // True when it cannot be there, the centre of the stylus' ball at `tip`, because the ball is.
  bool strikes(const Vector3& tip, const Vector3& ball, double ball_radius_mm) const;
};

}  // namespace probebox::world
