#pragma once
#include "drivers/world/config.hpp"
#include "drivers/world/vector.hpp"

namespace probebox::world {

// Computes the geometric errors of the linear axes (LinearErrorsConfig).
class LinearErrors {
 public:
  explicit LinearErrors(const LinearErrorsConfig& config);

  // Returns the position of the body minus the position on the scales, mm. Exactly zero for a machine without errors.
  Vector3 at(const Vector3& position) const;
  bool none() const { return none_; }

 private:
  LinearErrorsConfig config_;
  bool none_;
};

}  // namespace probebox::world
