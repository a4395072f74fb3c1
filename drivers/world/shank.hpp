#pragma once
#include <optional>

#include "drivers/world/meeting.hpp"
#include "drivers/world/motion.hpp"
#include "drivers/world/vector.hpp"

namespace probebox::world {

// Models the shank above the stylus' ball in its current orientation: a cylinder with round ends.
struct Shank {
  Vector3 low{}, high{};  // the ends of its axis, from the centre of the stylus' ball
  double radius_mm{};
  double lever{1};  // displacement of the ball per displacement of the shank

  // Returns where on a straight path of the stylus ball's centre the shank touches a ball. For a path that begins
  // inside, it is the point of entry before the beginning.
  std::optional<Meeting> meet(const Move& way, const Vector3& ball, double ball_radius_mm) const;
  // Returns whether shank and ball overlap with the centre of the stylus' ball at `tip`.
  bool strikes(const Vector3& tip, const Vector3& ball, double ball_radius_mm) const;
};

}  // namespace probebox::world
