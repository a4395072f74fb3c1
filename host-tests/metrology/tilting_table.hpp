#pragma once
#include <Eigen/Geometry>
#include <random>
#include <vector>

#include "host-tests/metrology/cases.hpp"
#include "protocol/units/angle.hpp"

// A table that tilts about an axis which is not quite where the control believes it, read with a ball on it.
namespace probebox::metrology {

struct Tilting {
  Eigen::Vector3d axis{1, 0, 0};          // machine axis that the control knows
  Eigen::Vector3d skew{0, 0, 0};          // what it is off
  Eigen::Vector3d pivot{0, -12.3, 45.6};  // a point of the axis
  Eigen::Vector3d c_axis{-3.0, -5.3, 0};  // C at tilt zero, parallel to Z
  Eigen::Vector3d ball{40, 2, 255.6};     // at tilt and C zero

  Eigen::Vector3d at(double tilt, double c) const {
    const Eigen::Vector3d on_c = c_axis + Eigen::AngleAxisd{c * kDegree, Eigen::Vector3d::UnitZ()} * (ball - c_axis);
    return pivot + Eigen::AngleAxisd{tilt * kDegree, (axis + skew).normalized()} * (on_c - pivot);
  }
};

inline Tilting randomTable(std::mt19937_64& random, double skew) {
  Tilting table;
  table.skew = {0, uniform(random, -skew, skew), uniform(random, -skew, skew)};
  table.pivot = {0, uniform(random, -20, 20), uniform(random, -40, 40)};
  table.c_axis = {uniform(random, -3, 3), table.pivot.y() + uniform(random, -10, 10), 0};
  // The pivot counts where the readings are: half way between C = 0 and 180.
  table.pivot.x() = table.c_axis.x();
  table.ball = {uniform(random, 20, 60), uniform(random, -20, 20), uniform(random, 120, 260)};
  return table;
}

inline Dataset tableDataset(const Tilting& table, const std::vector<double>& tilts, const std::vector<double>& cs,
                            double sigma, std::mt19937_64& random) {
  Dataset dataset{.method = "table-pivot",
                  .config = {{"sigma_mm", sigma},
                             {"tilt_axis", std::vector<double>{table.axis.x(), table.axis.y(), table.axis.z()}}},
                  .tables = {}};
  Table& readings = addTable(dataset, "readings", {"tilt_deg", "C_deg", "x_mm", "y_mm", "z_mm"});
  for (const double tilt : tilts) {
    for (const double c : cs) {
      const Eigen::Vector3d at = table.at(tilt, c);
      readings.append(
          {tilt, c, at.x() + gauss(random, sigma), at.y() + gauss(random, sigma), at.z() + gauss(random, sigma)});
    }
  }
  return dataset;
}

}  // namespace probebox::metrology
