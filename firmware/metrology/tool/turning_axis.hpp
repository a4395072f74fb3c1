#pragma once
#include <Eigen/Core>
#include <optional>

#include "firmware/metrology/dataset/dataset.hpp"
#include "firmware/metrology/dataset/result.hpp"
#include "protocol/units/outcome.hpp"

namespace probebox::metrology {

// The turning axis: c(Z) = at + tilt (Z - z).
struct TurningAxis {
  Eigen::Vector2d at;
  double z{};
  Eigen::Vector2d tilt{0.0, 0.0};
  double sd{};
  double tilt_sd{};

  Eigen::Vector2d here(double height) const { return at + tilt * (height - z); }
};

// Of a tool setter's case: centreline_mm, C_tilt_rad, centreline_z_mm and their sd; nothing where it states none.
// Refuses: missing-key (one that needs another), bad-config.
Outcome<std::optional<TurningAxis>, Refusal> turningAxis(const Dataset& dataset);

}  // namespace probebox::metrology
