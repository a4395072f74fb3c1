#pragma once
#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <optional>

#include "firmware/procedure/plan/step.hpp"
#include "protocol/units/outcome.hpp"
#include "tools/gcode/block.hpp"
#include "tools/gcode/setting.hpp"

namespace probebox::gcode {

// A feature with the space around it that traverses avoid.
struct Place {
  enum class Shape : std::uint8_t { round, gap, block };
  Shape shape{Shape::round};
  Eigen::Vector3d centre_mm{Eigen::Vector3d::Zero()};
  double keep_out_mm{};                              // traverses stay this far from the centre
  Eigen::Vector3d half_mm{Eigen::Vector3d::Zero()};  // of a block or gap: from the centre to where faces are met

  friend bool operator==(const Place&, const Place&) = default;
};

struct Feeds {
  double traverse_mm_min{}, near_mm_min{};
};

// Appends straight moves from one point near the place to another; between opposite sides they go over the top.
void goRound(Blocks& blocks, const Place& place, const Eigen::Vector3d& from, const Eigen::Vector3d& to,
             const Feeds& feeds);

// Appends the way from a point near the place to the safe height; from below the centre first to its side.
void goUp(Blocks& blocks, const Place& place, const Eigen::Vector3d& from, double safe_z_mm, const Feeds& feeds);

// Appends the way from the safe height to a point near the place.
void goDown(Blocks& blocks, const Place& place, const Eigen::Vector3d& to, double safe_z_mm, const Feeds& feeds);

inline Eigen::Vector3d vectorOf(const std::array<double, 3>& v) {
  return {v[0], v[1], v[2]};
}

// Centre of a ball of the part (from 0) with A, B and C there. tilts: B is that of the table, whose axis is stated.
Eigen::Vector3d ballInPose(std::size_t ball, const std::array<double, 3>& angles_rad, bool tilts,
                           const Setting& setting);
// True for a jog or a sweep, which touches no feature.
bool movesOneAxis(const procedure::Step& step);
// Explains what the setting lacks for this step; nullopt when it is complete.
std::optional<Error> whyUnknown(const procedure::Step& step, const Setting& setting);
// Place of a step's feature in the pose of that step, for a setting that whyUnknown() accepts.
Place placeOf(const procedure::Step& step, const Setting& setting);
// Point at which the tip meets the surface.
Eigen::Vector3d surfaceOf(const procedure::Step& step, const Place& place, const Setting& setting);

}  // namespace probebox::gcode
