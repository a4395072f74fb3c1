#pragma once
// A machine in three dimensions whose C and spindle axes are where they are: a reading is the position at which the
// stylus ball meets the ball on the chuck.
#include <Eigen/Geometry>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include "host-tests/metrology/cases.hpp"

namespace probebox::metrology {

inline constexpr double kPi = std::numbers::pi;
inline const std::vector<double> kOpposed{0.0, kPi};

// A mill-turn machine. The moving reference is where the spindle axis meets its gauge line.
struct Machine {
  Eigen::Vector3d c_point{0, 0, 0};      // a point of the C axis, relative to the spindle axis at machine zero
  Eigen::Vector2d c_tilt{0, 0};          // its direction (kx, ky, 1)
  Eigen::Vector2d spindle_tilt{0, 0};    // direction of the spindle axis
  Eigen::Vector3d ball{20, 5, 80};       // on the chuck, at C = 0
  Eigen::Vector2d stylus{0.02, -0.013};  // tip from the spindle axis, at A = 0

  // Position of the reference when a tip of this length meets the ball.
  Eigen::Vector3d reading(double spindle, double c, double length) const {
    const Eigen::Vector3d c_axis = Eigen::Vector3d{c_tilt.x(), c_tilt.y(), 1.0}.normalized();
    const Eigen::Vector3d spindle_axis = Eigen::Vector3d{spindle_tilt.x(), spindle_tilt.y(), 1.0}.normalized();
    const Eigen::Vector3d on_chuck = c_point + Eigen::AngleAxisd{c, c_axis} * (ball - c_point);
    const Eigen::Vector3d tip =
        length * spindle_axis + Eigen::AngleAxisd{spindle, spindle_axis} * Eigen::Vector3d{stylus.x(), stylus.y(), 0.0};
    return on_chuck - tip;
  }
  // Where the C axis is at this height.
  Eigen::Vector2d centreAt(double z) const { return c_point.head<2>() + c_tilt * (z - c_point.z()); }
};

inline Machine randomMachine(std::mt19937_64& random, double tilt) {
  Machine machine;
  machine.c_point = {uniform(random, -0.5, 0.5), uniform(random, -0.5, 0.5), uniform(random, -50, 50)};
  machine.c_tilt = {uniform(random, -tilt, tilt), uniform(random, -tilt, tilt)};
  machine.spindle_tilt = {uniform(random, -tilt, tilt), uniform(random, -tilt, tilt)};
  machine.ball = {uniform(random, 8, 40), uniform(random, -30, 30), uniform(random, 50, 300)};
  machine.stylus = {uniform(random, -0.1, 0.1), uniform(random, -0.1, 0.1)};
  return machine;
}

struct Row {
  double lever{};
  double spindle{};
  double c{};
  Eigen::Vector2d at{};
};

inline std::vector<Row> grid(const std::vector<double>& levers, const std::vector<double>& spindles,
                             const std::vector<double>& cs) {
  std::vector<Row> rows;
  for (const double lever : levers) {
    for (const double c : cs) {
      for (const double spindle : spindles) rows.push_back({lever, spindle, c, {}});
    }
  }
  return rows;
}

inline std::vector<Row> read(std::vector<Row> rows, const Machine& machine, double length = 0.0) {
  for (auto& row : rows) row.at = machine.reading(row.spindle, row.c, length).head<2>();
  return rows;
}

inline std::vector<Row> readAtHeights(std::vector<Row> rows, const Machine& machine) {
  for (auto& row : rows) {
    // Each height has a ball of its own, somewhere else on the holder.
    Machine at = machine;
    at.ball = {20.0 + std::sin(row.lever), 5.0 + std::cos(3.0 * row.lever), row.lever};
    row.at = at.reading(row.spindle, row.c, 100.0).head<2>();
  }
  return rows;
}

inline std::vector<Row> readWithTips(std::vector<Row> rows, const Machine& machine) {
  for (auto& row : rows) {
    Machine with_tip = machine;  // every tip is off the axis in its own way
    with_tip.stylus += Eigen::Vector2d{0.01 * std::sin(row.lever), 0.01 * std::cos(row.lever)};
    row.at = with_tip.reading(row.spindle, row.c, row.lever).head<2>();
  }
  return rows;
}

inline Dataset ballDataset(std::string method, std::string lever, const std::vector<Row>& rows, double sigma) {
  Dataset dataset{.method = std::move(method), .config = {{"sigma_mm", sigma}}, .tables = {}};
  stateExactMachine(dataset);
  std::vector<std::string_view> names{"A_rad", "C_rad", "x_mm", "y_mm"};
  if (!lever.empty()) names.push_back(lever);
  Table table = Table::withColumns("readings", names);
  for (const auto& row : rows) {
    if (lever.empty()) {
      table.append({row.spindle, row.c, row.at.x(), row.at.y()});
    } else {
      table.append({row.spindle, row.c, row.at.x(), row.at.y(), row.lever});
    }
  }
  dataset.tables.push_back(std::move(table));
  return dataset;
}

inline void blur(std::vector<Row>& rows, double sigma, std::mt19937_64& random) {
  for (auto& row : rows) row.at += Eigen::Vector2d{gauss(random, sigma), gauss(random, sigma)};
}

inline Eigen::VectorXd stacked(const std::vector<Row>& rows) {
  Eigen::VectorXd values{static_cast<Eigen::Index>(2 * rows.size())};
  for (std::size_t k = 0; k < rows.size(); ++k) values.segment<2>(static_cast<Eigen::Index>(2 * k)) = rows[k].at;
  return values;
}

}  // namespace probebox::metrology
