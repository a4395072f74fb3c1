#pragma once
#include <Eigen/Core>
#include <array>
#include <cmath>
#include <random>
#include <vector>

#include "host-tests/metrology/cases.hpp"
#include "protocol/units/angle.hpp"

namespace probebox::metrology {

// Three sensors that look along their own directions at a ball, in volts.
struct Sensors {
  Eigen::Matrix3d matrix;
  Eigen::Vector3d zero;
};

inline Sensors randomSensors(std::mt19937_64& random) {
  Sensors sensors;
  for (Eigen::Index k = 0; k < 3; ++k) {
    const double around = kTurn * static_cast<double>(k) / 3.0;
    const Eigen::Vector3d along{std::cos(around), std::sin(around), 0.8};
    sensors.matrix.row(k) = (along.normalized() + 0.1 * anywhere(random, 1.0)).transpose() * uniform(random, 1, 3);
  }
  sensors.zero = anywhere(random, 0.5);
  return sensors;
}

inline Dataset headDataset(const Sensors& sensors, double reach, double sigma, std::mt19937_64& random,
                           const std::vector<Eigen::Vector3d>& balls) {
  Dataset dataset{.method = "sensor-head-calibration", .config = {{"sigma_sensor", sigma}}, .tables = {}};
  Table moves =
      Table::withColumns("moves", std::array<std::string_view, 6>{"ux_mm", "uy_mm", "uz_mm", "s1", "s2", "s3"});
  const auto read = [&](const Eigen::Vector3d& u) {
    return Eigen::Vector3d{sensors.zero + sensors.matrix * u +
                           Eigen::Vector3d{gauss(random, sigma), gauss(random, sigma), gauss(random, sigma)}};
  };
  for (Eigen::Index axis = 0; axis < 3; ++axis) {
    for (const double way : {-1.0, -0.6, -0.2, 0.2, 0.6, 1.0}) {
      const Eigen::Vector3d u = way * reach * Eigen::Vector3d::Unit(axis);
      const Eigen::Vector3d s = read(u);
      moves.append({u.x(), u.y(), u.z(), s.x(), s.y(), s.z()});
    }
  }
  Table readings =
      Table::withColumns("readings", std::array<std::string_view, 6>{"x_mm", "y_mm", "z_mm", "s1", "s2", "s3"});
  for (const auto& ball : balls) {
    const Eigen::Vector3d machine = ball - anywhere(random, reach);
    const Eigen::Vector3d s = read(ball - machine);
    readings.append({machine.x(), machine.y(), machine.z(), s.x(), s.y(), s.z()});
  }
  dataset.tables = {std::move(moves)};
  if (!balls.empty()) dataset.tables.push_back(std::move(readings));
  return dataset;
}

}  // namespace probebox::metrology
