#pragma once
#include <Eigen/Core>
#include <numbers>
#include <random>
#include <utility>
#include <vector>

#include "firmware/metrology/dataset/dataset.hpp"

namespace probebox::metrology::simulation {

// Scans of the equator of a sphere, the radius stepping over some arcs: motion and both streams in time.
struct ScanScene {
  double machine_rate_hz{500.0};
  double probe_rate_hz{1000.0};
  double machine_sigma_mm{0.0005};
  double probe_sigma_mm{0.0004};
  double correlation{0.0};  // of the noise of neighbouring samples of either stream (AR(1))
  double machine_resolution_mm{0.0};
  double stamp_jitter_s{0.0};
  double lost_share{0.0};  // of the samples
  std::vector<double> speeds_mm_s{20.0, 40.0, 60.0};
  double sphere_mm{15.5};  // effective radius
  double outer_mm{15.4};
  double inner_mm{15.2};
  double transition_rad{6.0 * std::numbers::pi / 180.0};  // of the angle, for a step
  std::vector<std::pair<double, double>> arcs_rad{{0.698, 1.047}, {1.745, 2.531}, {3.578, 4.887}};
  double turns{0.95};
  Eigen::Vector3d centre_mm{50.0, -20.0, 5.0};
  Eigen::Vector3d centre_error_mm{0.002, -0.001, 0.001};
  Eigen::Matrix3d gain{Eigen::Matrix3d::Identity()};  // A of (A3)
  double window_s{0.05};
  double tau_s{0.0034};

  // (A17b) of all scans together, s. Unless the radius stands.
  double bound_s() const;
};

Dataset measure(const ScanScene& scene, std::mt19937_64& random);

}  // namespace probebox::metrology::simulation
