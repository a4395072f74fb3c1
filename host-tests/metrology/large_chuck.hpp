#pragma once
#include <Eigen/Geometry>
#include <array>
#include <cmath>
#include <numbers>
#include <random>
#include <stdexcept>
#include <vector>

#include "firmware/metrology/centreline/limited_access.hpp"
#include "firmware/metrology/centreline/rim_steps.hpp"
#include "host-tests/metrology/cases.hpp"
#include "protocol/units/angle.hpp"

// A large chuck of which the probe reaches an arc.
namespace probebox::metrology {

struct ReachedChuck {
  Eigen::Vector2d centre{0.35, -0.62};
  double radius{600.0};
  double psi{0.9 * kDegree};

  // Turned clockwise from +Y, seen from +Z: the negative sense of a rotation about Z.
  Eigen::Vector2d ball(double c) const {
    const Eigen::Vector3d on_rim =
        Eigen::AngleAxisd{-(c + psi), Eigen::Vector3d::UnitZ()} * Eigen::Vector3d{0, radius, 0};
    return centre + on_rim.head<2>();
  }
};

inline ReachedChuck randomReachedChuck(std::mt19937_64& random) {
  return {{uniform(random, -0.5, 0.5), uniform(random, -0.5, 0.5)},
          uniform(random, 300, 1500),
          uniform(random, -0.03, 0.03)};
}

inline Dataset rimDataset(const ReachedChuck& chuck, const std::vector<double>& angles, double sigma, double sigma_c,
                          std::mt19937_64& random) {
  Dataset dataset{
      .method = "centreline-limited-access", .config = {{"sigma_mm", sigma}, {"sigma_C_rad", sigma_c}}, .tables = {}};
  Table& table = addTable(dataset, "readings", {"C_rad_clockwise_from_plus_y", "x_mm", "y_mm"});
  for (const double c : angles) {
    const Eigen::Vector2d at = chuck.ball(c + gauss(random, sigma_c));
    table.append({c, at.x() + gauss(random, sigma), at.y() + gauss(random, sigma)});
  }
  return dataset;
}

inline std::vector<double> fiveAngles(double theta) {
  return {-theta, theta, 0.0, theta / 2, -theta / 2};
}

struct Chuck {
  Eigen::Vector2d centre{0.35, -0.62};
  double radius{600.0};
  double psi{0.9 * kDegree};
  Eigen::Vector2d stylus{0.0, 0.0};
  double sigma{0.001};
  double sigma_c{0.0};
  double most_off{0.0};  // rad: C stops so far beside what it is asked for at most, and says so

  // Machine position at the count C, clockwise from +Y; the spindle at zero.
  Eigen::Vector2d reading(double c, std::mt19937_64& random) const {
    const double angle = c + psi + gauss(random, sigma_c);
    return centre + radius * Eigen::Vector2d{std::sin(angle), std::cos(angle)} - stylus +
           Eigen::Vector2d{gauss(random, sigma), gauss(random, sigma)};
  }
};

inline Chuck randomChuck(std::mt19937_64& random) {
  Chuck chuck;
  chuck.centre = {uniform(random, -0.5, 0.5), uniform(random, -0.5, 0.5)};
  chuck.radius = uniform(random, 300, 1200);
  chuck.psi = uniform(random, -0.02, 0.02);
  chuck.stylus = {uniform(random, -.05, .05), uniform(random, -.05, .05)};
  chuck.sigma = uniform(random, 5e-4, 1.5e-3);
  return chuck;
}

inline Dataset goThrough(const Chuck& chuck, double theta, std::mt19937_64& random) {
  Dataset dataset{.method = "centreline-by-steps",
                  .config = {{"sigma_mm", chuck.sigma}, {"sigma_C_rad", chuck.sigma_c}},
                  .tables = {}};
  Table stylus = Table::withColumns("stylus", std::array<std::string_view, 3>{"A_rad", "x_mm", "y_mm"});
  for (const double a : {0.0, std::numbers::pi}) {
    const Eigen::Vector2d at = chuck.centre + chuck.radius * Eigen::Vector2d{std::sin(chuck.psi), std::cos(chuck.psi)} -
                               Eigen::Rotation2Dd{a} * chuck.stylus +
                               Eigen::Vector2d{gauss(random, chuck.sigma), gauss(random, chuck.sigma)};
    stylus.append({a, at.x(), at.y()});
  }
  Table readings = Table::withColumns(
      "readings", std::array<std::string_view, 4>{"loop", "C_rad_clockwise_from_plus_y", "x_mm", "y_mm"});
  double zero = 0.0;
  const auto readAt = [&](double loop, double wanted) {
    const double c = chuck.most_off > 0 ? wanted + uniform(random, -chuck.most_off, chuck.most_off) : wanted;
    const RimReading reading{.at = chuck.reading(zero + c, random), .c = c};
    readings.append({loop, c, reading.at.x(), reading.at.y()});
    return RimReading{.at = reading.at + chuck.stylus, .c = c};
  };
  for (double loop = 1.0; loop <= 5.0; ++loop) {
    const std::array both{readAt(loop, theta), readAt(loop, -theta)};
    const auto level = rimStepsOf(both);
    if (!level) throw std::logic_error{"theta is not the same twice"};
    if (std::abs(level->plus.y() - level->minus.y()) < 0.01) {
      readAt(loop, 0.0);
      break;
    }
    zero += remainingShift(level->plus, level->minus);
  }
  dataset.tables = {std::move(stylus), std::move(readings)};
  return dataset;
}

}  // namespace probebox::metrology
