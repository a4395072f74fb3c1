#pragma once
#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>
#include <vector>

#include "firmware/metrology/touch/pre_travel.hpp"
#include "firmware/metrology/touch/switched_touch.hpp"

namespace probebox::metrology {

// A touch-trigger probe that drives onto a sphere and back; its switch repeats to `scatter_mm`.
struct Probe {
  double mean_mm{0.010}, cosine_mm{0.003}, sine_mm{-0.002}, along_mm{0.004};
  double late_s{0.0006};
  double scatter_mm{};

  static constexpr double kSpeed_mm_s = 5, kRadius_mm = 15;  // of the touches, and of the sphere

  double preTravel(const Eigen::Vector3d& n) const {
    const double across = std::hypot(n.x(), n.y()), around = std::atan2(n.y(), n.x());
    return across * (mean_mm + cosine_mm * std::cos(3 * around) + sine_mm * std::sin(3 * around)) +
           along_mm * std::abs(n.z());
  }
};

inline Eigen::Vector3d directionAt(double around_deg, double up_deg) {
  const double around = around_deg * std::numbers::pi / 180, up = up_deg * std::numbers::pi / 180;
  return {std::cos(up) * std::cos(around), std::cos(up) * std::sin(around), std::sin(up)};
}

// Twelve sides at the equator and six at 45 degrees; the top; from below as well where the holder allows it.
inline std::vector<Eigen::Vector3d> directions(bool from_below) {
  std::vector<Eigen::Vector3d> all;
  for (int k = 0; k < 12; ++k) all.push_back(directionAt(30 * k, 0));
  for (int k = 0; k < 6; ++k) all.push_back(directionAt(60 * k + 10, 45));
  all.push_back({0, 0, 1});
  for (int k = 0; from_below && k < 6; ++k) all.push_back(directionAt(60 * k, -30));
  return all;
}

inline Dataset touched(const Probe& probe, const std::vector<Eigen::Vector3d>& sides, const Eigen::Vector3d& centre,
                       std::uint64_t seed = 1) {
  std::mt19937_64 random{seed};
  std::normal_distribution<double> normal;
  constexpr double kSpeed_mm_s = Probe::kSpeed_mm_s, kRadius_mm = Probe::kRadius_mm;
  auto machine = Table::withColumns("machine", kMachineColumns);
  auto touches = Table::withColumns("touches", kTouchesColumns);
  auto edges = Table::withColumns("edges", kEdgesColumns);
  constexpr double kOutside_mm = 0.5, kInside_mm = 0.5, kDwell_s = 0.1;
  constexpr double kTurn_s = (kOutside_mm + kInside_mm) / kSpeed_mm_s;
  for (std::size_t i = 0; i < sides.size(); ++i) {
    const auto number = static_cast<double>(i);
    const Eigen::Vector3d& n = sides[i];
    for (int k = 0; k < 500 * (2 * kTurn_s + kDwell_s); ++k) {
      const double t = k / 500.0;
      const double in = std::min(t, kTurn_s), out = std::max(0.0, t - kTurn_s - kDwell_s);
      const Eigen::Vector3d at = centre + (kRadius_mm + kOutside_mm - kSpeed_mm_s * (in - out)) * n;
      machine.append({number, t, at.x(), at.y(), at.z()});
    }
    touches.append({number, n.x(), n.y(), n.z(), n.x(), n.y(), n.z(), kSpeed_mm_s});
    // The same way in and out: the scatter is that of the reading.
    const double way_mm = probe.preTravel(n) + probe.scatter_mm * normal(random);
    edges.append({number, (kOutside_mm + way_mm) / kSpeed_mm_s + probe.late_s,
                  2 * kTurn_s + kDwell_s - (kOutside_mm + way_mm) / kSpeed_mm_s + probe.late_s});
  }
  Dataset dataset{.method = "pre-travel", .config = {}, .tables = {machine, touches, edges}};
  dataset.config["effective_diameter_mm"] = 2 * kRadius_mm;
  return dataset;
}

}  // namespace probebox::metrology
