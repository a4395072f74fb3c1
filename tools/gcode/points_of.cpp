#include "tools/gcode/points_of.hpp"

#include <Eigen/Geometry>
#include <cmath>

#include "protocol/units/angle.hpp"

namespace probebox::gcode {

std::vector<Eigen::Vector3d> pointsOf(const Move& move, const Eigen::Vector3d& from_mm) {
  constexpr double kStep_rad = 0.05;
  std::vector<Eigen::Vector3d> points;
  if (move.arc) {
    const Eigen::Vector2d centre = from_mm.head<2>() + move.arc->to_centre_mm, begin = -move.arc->to_centre_mm,
                          end = move.to_mm.head<2>() - centre;
    double turn_rad = std::atan2(begin.x() * end.y() - begin.y() * end.x(), begin.dot(end));
    if (move.arc->clockwise && turn_rad > 0) turn_rad -= kTurn;
    if (!move.arc->clockwise && turn_rad < 0) turn_rad += kTurn;
    const int steps = static_cast<int>(std::abs(turn_rad) / kStep_rad);
    for (int i = 1; i <= steps; ++i) {
      const Eigen::Vector2d at = centre + Eigen::Rotation2Dd{turn_rad * i / (steps + 1)} * begin;
      points.emplace_back(at.x(), at.y(), move.to_mm.z());
    }
  }
  points.push_back(move.to_mm);
  return points;
}

}  // namespace probebox::gcode
