#pragma once
#include "drivers/world/config.hpp"
#include "drivers/world/vector.hpp"

namespace probebox::world {

// What the linear axes do beside what their scales show (LinearErrorsConfig).
class LinearErrors {
 public:
  explicit LinearErrors(const LinearErrorsConfig& config);

  // From the position that the scales show to where the body is, mm. Exactly zero for a machine without errors.
  Vector3 at(const Vector3& position) const;
  bool none() const { return none_; }

 private:
  LinearErrorsConfig config_;
  bool none_;
};

}  // namespace probebox::world
