#pragma once
#include <Eigen/Geometry>
#include <array>
#include <cmath>
#include <random>
#include <string>
#include <vector>

#include "firmware/metrology/rotary/rotary_axis_errors.hpp"
#include "host-tests/metrology/cases.hpp"
#include "host-tests/metrology/turned.hpp"
#include "protocol/units/angle.hpp"

// A rotary table that moves a ball plate by exact rotations, and beside them by its six errors.
namespace probebox::metrology {

struct Plate {
  std::vector<Eigen::Vector3d> balls;
  Eigen::Matrix3d rotation = turned({.002, -.001, .2});
  Eigen::Vector3d shift{.4, -.3, 15};

  Eigen::Vector3d at(std::size_t ball) const { return rotation * balls[ball] + shift; }
};

inline Plate plateOf(std::size_t balls, double radius) {
  Plate plate;
  for (std::size_t k = 0; k < balls; ++k) {
    const double angle = kTurn * static_cast<double>(k) / static_cast<double>(balls);
    plate.balls.emplace_back(radius * std::cos(angle), radius * std::sin(angle), k % 2 == 0 ? 40.0 : 60.0);
  }
  return plate;
}

struct RotaryTable {
  Eigen::Vector3d point{0, 0, 0};
  Eigen::Vector3d direction{0, 0, 1};
  std::vector<double> angles;
  std::vector<SixErrors> errors;

  Eigen::Vector3d moved(const Eigen::Vector3d& at_zero, std::size_t k) const {
    const Eigen::Vector3d ideal = Eigen::AngleAxisd{angles[k], direction} * (at_zero - point);
    return point + errors[k].head<3>() + turned(errors[k].tail<3>()) * ideal;
  }
};

// Location errors and harmonics, nothing at zero.
inline RotaryTable randomTable(std::size_t angles, std::mt19937_64& random) {
  RotaryTable table;
  SixErrors amplitude;
  amplitude << 0.01, 0.01, 0.004, 5e-5, 5e-5, 2e-5;
  SixErrors phase;
  for (double& value : phase) value = uniform(random, -3, 3);
  for (double& value : amplitude) value *= uniform(random, -1, 1);
  for (std::size_t k = 0; k < angles; ++k) {
    table.angles.push_back(kTurn * static_cast<double>(k) / static_cast<double>(angles));
    SixErrors errors;
    for (Eigen::Index e = 0; e < 6; ++e) {
      errors[e] = amplitude[e] * (std::cos(table.angles.back() + phase[e]) - std::cos(phase[e]) +
                                  0.3 * std::sin(3.0 * table.angles.back()));
    }
    table.errors.push_back(errors);
  }
  return table;
}

inline Dataset rotaryDataset(const RotaryTable& table, const Plate& plate, double sigma, std::mt19937_64& random) {
  const auto list = [](const Eigen::Vector3d& v) { return std::vector<double>{v.x(), v.y(), v.z()}; };
  Dataset dataset{.method = "rotary-axis-errors",
                  .config = {{"axis", std::string{"C"}},
                             {"axis_point_mm", list(table.point)},
                             {"axis_direction", list(table.direction)},
                             {"sigma_mm", sigma}},
                  .tables = {}};
  stateExactMachine(dataset);
  constexpr std::array<std::string_view, 4> kBall{"ball", "x_mm", "y_mm", "z_mm"};
  Table first = Table::withColumns("first", std::array<std::string_view, 5>{"phi_rad", "ball", "x_mm", "y_mm", "z_mm"});
  Table second = Table::withColumns("second", kBall);
  Table third = Table::withColumns("third", kBall);
  const auto blurred = [&](const Eigen::Vector3d& at) {
    return Eigen::Vector3d{at + Eigen::Vector3d{gauss(random, sigma), gauss(random, sigma), gauss(random, sigma)}};
  };
  for (std::size_t ball = 0; ball < plate.balls.size(); ++ball) {
    const auto id = static_cast<double>(ball);
    const Eigen::Vector3d at = blurred(plate.at(ball));
    second.append({id, at.x(), at.y(), at.z()});
    third.append({id, plate.balls[ball].x(), plate.balls[ball].y(), plate.balls[ball].z()});
    for (std::size_t k = 0; k < table.angles.size(); ++k) {
      const Eigen::Vector3d read = blurred(table.moved(plate.at(ball), k));
      first.append({table.angles[k], id, read.x(), read.y(), read.z()});
    }
  }
  dataset.tables = {std::move(first), std::move(second), std::move(third)};
  return dataset;
}

}  // namespace probebox::metrology
