#include "firmware/procedure/dataset/scan_centre.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "firmware/metrology/fit/decompositions.hpp"
#include "protocol/units/angle.hpp"

namespace probebox::procedure {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr int kIterations = 10;

// Distance of a commanded path from the middle, where it has turned by so much.
double radiusAt(const ScanPath& path, double reach_mm, double turned_rad) {
  double from_mm = reach_mm - path.depths_mm[0], behind_rad = 0;
  for (std::size_t i = 0; i < waysOf(path); ++i) {
    const ScanWay way = wayOf(path, i);
    const double turn_rad = std::abs(way.turn_rad), to_mm = reach_mm - way.to_depth_mm;
    const double within_rad = std::clamp(turned_rad - behind_rad, 0.0, turn_rad);
    if (turned_rad <= behind_rad + turn_rad || i + 1 == waysOf(path)) {
      if (way.is_arc) return to_mm;
      // A straight line in polar coordinates.
      return from_mm * to_mm * std::sin(turn_rad) /
             (from_mm * std::sin(within_rad) + to_mm * std::sin(turn_rad - within_rad));
    }
    behind_rad += turn_rad;
    from_mm = to_mm;
  }
  return from_mm;
}

// From the start of the path on; a little less than nothing counts as that.
double turnedBy(const ScanPath& path, const Vector3d& from_centre) {
  constexpr double kBefore_rad = 0.1;
  const double turned_rad = path.sense * (std::atan2(from_centre.y(), from_centre.x()) - path.start_rad);
  return turned_rad - kTurn * std::floor((turned_rad + kBefore_rad) / kTurn);
}

}  // namespace

Vector3d scanCentre(const metrology::Table& machine, const capture::Recording& recording, double reach_mm) {
  const auto column = [&](std::size_t i) -> const std::vector<double>& { return machine.columns[i].values; };
  const std::size_t rows = machine.rows();
  if (rows == 0) return Vector3d::Zero();
  Vector3d mean = Vector3d::Zero();
  for (std::size_t i = 0; i < rows; ++i)
    mean += Vector3d{column(2)[i], column(3)[i], column(4)[i]} / static_cast<double>(rows);
  const ScanPath& first = recording.touches().front().request.scan;
  const double begin_mm = reach_mm - first.depths_mm[0];
  Vector3d centre{column(2)[0] - begin_mm * std::cos(first.start_rad),
                  column(3)[0] - begin_mm * std::sin(first.start_rad), mean.z()};
  for (int iteration = 0; iteration < kIterations; ++iteration) {
    Matrix3d normal = Matrix3d::Zero();  // of the middle in the plane, and of the radius
    Vector3d right = Vector3d::Zero();
    for (const auto& scan : recording.touches()) {
      for (std::size_t i = 0; i < rows; ++i) {
        if (column(0)[i] != scan.request.step) continue;
        const Vector3d off = Vector3d{column(2)[i], column(3)[i], mean.z()} - centre;
        const double radius_mm = off.norm();
        if (!(radius_mm > 0)) continue;
        const Vector3d row{off.x() / radius_mm, off.y() / radius_mm, 1};
        const double wanted_mm = radiusAt(scan.request.scan, reach_mm, turnedBy(scan.request.scan, off));
        normal += row * row.transpose();
        right += row * (radius_mm - wanted_mm);
      }
    }
    const auto step = metrology::solutionIfInvertible(normal, right);
    if (!step || !(step->head<2>().norm() < reach_mm)) return mean;
    centre.head<2>() += step->head<2>();
  }
  return centre;
}

}  // namespace probebox::procedure
