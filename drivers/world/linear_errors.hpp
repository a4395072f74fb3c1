#pragma once
#include "board/describe/world.hpp"
#include "drivers/world/vector.hpp"

namespace probebox::world {

// Computes the geometric errors of the linear axes (board::WorldLinearAxes).
class LinearErrors {
 public:
  explicit LinearErrors(const board::WorldLinearAxes& config);

  // Returns the position of the body minus the position on the scales, mm. Exactly zero for a machine without errors.
  Vector3 at(const Vector3& position) const;
  bool none() const { return none_; }

 private:
  board::WorldLinearAxes config_;
  bool none_;
};

}  // namespace probebox::world
