#pragma once
#include <Eigen/Geometry>
#include <array>
#include <cmath>
#include <random>

#include "host-tests/metrology/cases.hpp"
#include "protocol/units/angle.hpp"

namespace probebox::metrology {

// Two balls at two heights, read from five sides at four angles of C, eight times in four hours, while the screws of X
// and Z warm and cool.
struct SimulatedShift {
  double tau_s{0.004}, radius_mm{15.5}, sigma_mm{5e-4};
  Eigen::Vector2d centre_mm{250, 180}, tilt_rad{4e-5, -7e-5};
  double gain_x{0.93}, gain_z{1.08};
  Eigen::Vector3d drift_um_per_min{0.02, -0.035, 0.05};
  std::array<double, 2> speeds_mm_s{5, 30}, heights_mm{40, 240};
  double arm_mm{80};
  int angles{4}, rounds{8};
  bool warms_evenly{};

  double extension(double minutes, double most_um) const {
    if (warms_evenly) return most_um * minutes / 240;
    return most_um * (1 - std::exp(-minutes / 35)) * (minutes < 150 ? 1 : std::exp(-(minutes - 150) / 50));
  }

  Dataset dataset(std::mt19937_64& random, Eigen::Vector2d* centre_at_mean = nullptr) const {
    Dataset made{.method = "joint",
                 .config = {{"sigma_mm", sigma_mm},
                            {"screw_length_x_mm", 700.0},
                            {"orgoff_x_mm", 60.0},
                            {"screw_length_z_mm", 600.0},
                            {"orgoff_z_mm", 80.0}},
                 .tables = {}};
    Table& table = addTable(
        made, "readings",
        {"time_s", "ball", "C_rad", "nx", "ny", "nz", "speed_mm_s", "x_mm", "y_mm", "z_mm", "ext_x_um", "ext_z_um"});
    double minutes = 0, sum = 0, count = 0;
    for (int round = 0; round < rounds; ++round) {
      for (int ball = 0; ball < 2; ++ball) {
        for (int k = 0; k < angles; ++k) {
          const double c = kTurn * k / std::max(angles, 4);
          const Eigen::Vector2d arm = Eigen::Rotation2Dd{c + ball} * Eigen::Vector2d{arm_mm, 0};
          const double height = heights_mm[static_cast<std::size_t>(ball)];
          const Eigen::Vector3d place{centre_mm.x() + tilt_rad.x() * (height - 140) + arm.x(),
                                      centre_mm.y() + tilt_rad.y() * (height - 140) + arm.y(),
                                      height - tilt_rad.dot(arm)};
          for (int side = 0; side < 5; ++side) {
            const Eigen::Vector3d n = side == 4
                                          ? Eigen::Vector3d{0, 0, 1}
                                          : Eigen::Vector3d{std::cos(kTurn / 4 * side), std::sin(kTurn / 4 * side), 0};
            // Each side at another speed than in the pose before.
            const double speed = speeds_mm_s[static_cast<std::size_t>(side + k + round) % 2];
            const double ext_x = extension(minutes, 45), ext_z = extension(minutes, -30);
            Eigen::Vector3d at =
                place + n * (radius_mm - tau_s * speed + gauss(random, sigma_mm)) + 1e-3 * minutes * drift_um_per_min;
            const Eigen::Vector3d read = at;
            at.x() -= gain_x * 1e-3 * (read.x() + 60) / 700 * ext_x;
            at.z() -= gain_z * 1e-3 * (read.z() + 80) / 600 * ext_z;
            table.append({60 * minutes, ball + 1.0, c, n.x(), n.y(), n.z(), speed, at.x(), at.y(), at.z(),
                          ext_x + gauss(random, 0.05), ext_z + gauss(random, 0.05)});
            sum += minutes;
            count += 1;
            minutes += 0.7;
          }
        }
      }
    }
    if (centre_at_mean != nullptr) {
      double mean_z = 0;
      for (const double z : *table.column("z_mm")) mean_z += z / count;
      *centre_at_mean = centre_mm + tilt_rad * (mean_z - 140) + 1e-3 * sum / count * drift_um_per_min.head<2>();
    }
    return made;
  }
};

}  // namespace probebox::metrology
