#pragma once
#include <Eigen/Geometry>
#include <cstddef>
#include <span>
#include <vector>

#include "board/describe/cell.hpp"
#include "tools/interference/program.hpp"

namespace probebox::interference {

// A ball around something that an axis carries, mm.
struct Around {
  Eigen::Vector3d middle{};
  double radius_mm{};
};

// Where the rotary axes of a cell turn what they carry, and how far they move it.
class Turning {
 public:
  // gauge_mm: height of the gauge line above the tip, from which the axes of a head are described.
  Turning(const std::vector<board::CellRotary>& axes, double gauge_mm);

  // Of the solids that the axis at `place` carries, from their place at zero.
  Eigen::Isometry3d ofSolids(std::size_t place, const Angles& angles_deg) const;
  // Of the tool, from upright; the origin is its tip, if it were on the spindle axis.
  Eigen::Isometry3d ofTool(const Angles& angles_deg) const;

  // Adds a ball at angles 0 that the axis at `place`, or the head, carries; far() then has an upper bound for it.
  void carry(std::size_t place, const Around& around);
  void carryTool(const Around& around);
  // An upper bound for the Z of a ball that the axis at `place` carries, however the axes stand.
  double highest(std::size_t place, const Around& around) const;
  // How far all of these move at most while the axes turn, mm.
  double far(const Angles& from_deg, const Angles& to_deg) const;

 private:
  struct Axis {
    std::size_t letter{};
    board::Carries carries{};
    Eigen::Vector3d direction, through;
    double arm_mm{};  // of the furthest point that it turns
  };
  std::vector<std::size_t> chain(board::Carries carries, std::size_t last) const;
  Eigen::Isometry3d along(std::span<const std::size_t> chain, const Angles& angles_deg) const;
  void lengthen(std::span<const std::size_t> chain, const Around& around);

  std::vector<Axis> axes_;
};

}  // namespace probebox::interference
