#pragma once
#include <Eigen/Core>
#include <cstdint>

#include "tools/gcode/block.hpp"

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

}  // namespace probebox::gcode
