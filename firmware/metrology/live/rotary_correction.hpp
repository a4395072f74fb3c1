#pragma once
#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <optional>
#include <span>

#include "firmware/metrology/live/angle_table.hpp"
#include "firmware/metrology/live/rotary_chain.hpp"
#include "protocol/units/outcome.hpp"

namespace probebox::metrology {

inline constexpr std::size_t kMostLinks = 3;

// One calibrated rotary axis of a table: its nominal position and its six errors by angle.
struct CalibratedAxis {
  Eigen::Vector3d point = Eigen::Vector3d::Zero();  // of the axis at all angles zero, mm
  Eigen::Vector3d direction = Eigen::Vector3d::UnitZ();
  AngleTable<6> errors;
};

// Computes at every tick the correction of the commanded tool point for the errors of a table's stacked rotary axes, so
// that the tool follows the point of the table (docs/metrology.md (E9) and F). Allocates nothing after construction.
class RotaryCorrection {
 public:
  // links: from the base outwards (B, then C). Refuses: too-many-axes (more than 3, or none).
  static Outcome<RotaryCorrection, Refusal> of(std::span<const CalibratedAxis> links);

  // Returns + [delta + eps x p] of all links, mm, machine axes. angles: rad, one per link, right-handed about its
  // direction; point: mm, of the tool in the table's frame, all angles zero. Nothing if an angle is missing or outside
  // its table: without its inputs a correction is invalid, never zero.
  std::optional<Eigen::Vector3d> at(std::span<const std::optional<double>> angles, const Eigen::Vector3d& point) const;

  // The point of the table, in its own frame, that its nominal axes bring to `machine_point` (mm, machine axes) at
  // these angles. Nothing without one of the angles.
  std::optional<Eigen::Vector3d> tablePoint(std::span<const std::optional<double>> angles,
                                            const Eigen::Vector3d& machine_point) const;

 private:
  std::size_t count_{};
  std::array<CalibratedAxis, kMostLinks> links_{};
};

}  // namespace probebox::metrology
