#pragma once
#include <Eigen/Core>
#include <random>
#include <vector>

#include "firmware/metrology/dataset.hpp"

namespace probebox::metrology::simulation {

// A machine that touches a datum sphere: motion, contact and both streams in time. It knows nothing of windows or
// lines.
struct Scene {
  double machine_rate_hz{500.0};
  double probe_rate_hz{1000.0};
  double machine_sigma_mm{0.0005};
  double probe_sigma_mm{0.0004};
  double machine_resolution_mm{0.0};  // of the encoder
  double stamp_jitter_s{0.0};
  double lost_share{0.0};  // of the samples
  double bounce_mm{0.02};
  double overtravel_mm{0.5};
  double clearance_mm{0.6};
  double acceleration_mm_s2{20000.0};
  double dwell_s{0.02};
  std::vector<double> speeds_mm_s{5.0, 10.0, 20.0, 30.0, 40.0};
  std::vector<Eigen::Vector3d> normals{{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}};
  double radius_mm{15.5};  // effective; negative for touches from within, the normals pointing inwards
  Eigen::Vector3d centre_mm{0.0, 0.0, 0.0};
  Eigen::Matrix3d gain{Eigen::Matrix3d::Identity()};  // A of (A3)
  double machine_delay_s{0.004};
  double probe_delay_s{0.0001};

  double tau() const { return machine_delay_s - probe_delay_s; }
};

Scene withoutNoise(Scene scene);

// The scene with another centre, coupled gain and delays.
Scene shuffled(Scene scene, std::mt19937_64& random);

// Touches of every normal at every speed, speed by speed.
Dataset measure(const Scene& scene, std::mt19937_64& random);

// Reference precision: the Fisher matrix of (A12) with the uncertainty (A8) of the retract windows of metrology A.3.
struct Reference {
  double tau_sd_s{};
  double diameter_sd_mm{};
};
Reference referencePrecision(const Scene& scene);

}  // namespace probebox::metrology::simulation
