#pragma once
#include <Eigen/Geometry>
#include <random>
#include <vector>

#include "firmware/metrology/centreline/centreline.hpp"
#include "host-tests/metrology/cases.hpp"

// One feature that is turned about an axis.
namespace probebox::metrology {

inline Dataset centrelineDataset(const std::vector<RotationReading>& readings, double sigma) {
  Dataset dataset{.method = "centreline", .config = {{"sigma_mm", sigma}}, .tables = {}};
  Table& table = addTable(dataset, "readings", {"C_rad", "x_mm", "y_mm"});
  for (const auto& reading : readings) table.append({reading.angle, reading.at.x(), reading.at.y()});
  return dataset;
}

inline std::vector<RotationReading> turnedFeature(const Eigen::Vector2d& centre, const Eigen::Vector2d& arm,
                                                  const std::vector<double>& angles, double sigma, double sigma_angle,
                                                  std::mt19937_64& random) {
  std::vector<RotationReading> readings;
  for (const double angle : angles) {
    const Eigen::Vector2d at = centre + Eigen::Rotation2Dd{angle + gauss(random, sigma_angle)} * arm;
    readings.push_back({at + Eigen::Vector2d{gauss(random, sigma), gauss(random, sigma)}, angle});
  }
  return readings;
}

}  // namespace probebox::metrology
