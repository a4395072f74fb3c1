#pragma once
#include <optional>

#include "drivers/world/meeting.hpp"
#include "drivers/world/motion.hpp"
#include "drivers/world/vector.hpp"

namespace probebox::world {

// Models a ball for the path of the stylus ball's centre.
struct SolidBall {
  Vector3 centre{};
  double reach_mm{};  // radius of the ball and of the stylus ball

  std::optional<Meeting> meet(const Move& way) const;
};

}  // namespace probebox::world
