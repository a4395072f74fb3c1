#pragma once
#include <Eigen/Geometry>

#include "host-tests/metrology/cases.hpp"
#include "protocol/units/angle.hpp"

// A swivelling head that turns its stylus about a pivot before a ball that stands.
namespace probebox::metrology {

struct PivotedHead {
  Eigen::Vector3d axis{0, 1, 0};
  Eigen::Vector3d pivot{-0.04, 0, -132.0};  // from the moving reference
  Eigen::Vector3d tip{-0.17, 0, 100.0};     // spindle axis at the stylus' length, from the moving reference, at B = 0
  Eigen::Vector3d stylus{0.02, -0.04, 0};   // from the spindle axis
  Eigen::Vector3d ball{18.0, -9.0, -8.0};

  Eigen::Vector3d reading(double b, double a) const {
    const Eigen::Vector3d at_zero = tip + Eigen::AngleAxisd{a * kDegree, Eigen::Vector3d::UnitZ()} * stylus;
    return ball - (pivot + Eigen::AngleAxisd{b * kDegree, axis} * (at_zero - pivot));
  }
};

// At two angles of the head, the spindle turned once.
inline Dataset pivotDataset(const PivotedHead& head, double sigma, std::mt19937_64& random) {
  Dataset dataset{.method = "head-pivot",
                  .config = {{"sigma_mm", sigma},
                             {"ball_mm", std::vector<double>{head.ball.x(), head.ball.y(), head.ball.z()}},
                             {"swivel_axis", std::vector<double>{0, head.axis.y(), 0}}},
                  .tables = {}};
  Table& readings = addTable(dataset, "readings", {"B_deg", "A_deg", "x_mm", "y_mm", "z_mm"});
  for (const double b : {0.0, 90.0}) {
    for (const double a : {0.0, 180.0}) {
      const Eigen::Vector3d at = head.reading(b, a);
      readings.append(
          {b, a, at.x() + gauss(random, sigma), at.y() + gauss(random, sigma), at.z() + gauss(random, sigma)});
    }
  }
  return dataset;
}

}  // namespace probebox::metrology
