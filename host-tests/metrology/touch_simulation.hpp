#pragma once
#include <Eigen/Core>
#include <functional>
#include <random>
#include <string>
#include <vector>

#include "firmware/metrology/dataset/dataset.hpp"

namespace probebox::metrology::simulation {

// A machine that touches a datum sphere, or two parallel faces: motion, contact and both streams in time. It knows
// nothing of windows or lines.
struct Scene {
  std::string method{"delay-multi-speed"};
  double machine_rate_hz{500.0};
  double probe_rate_hz{1000.0};
  double machine_sigma_mm{0.0005};
  double probe_sigma_mm{0.0004};
  double correlation{0.0};            // of the noise of neighbouring samples of either stream (AR(1))
  double machine_resolution_mm{0.0};  // of the encoder
  double stamp_jitter_s{0.0};
  double lost_share{0.0};  // of the samples
  double bounce_mm{0.02};
  bool bounces_off{};  // the ball leaves the surface and falls back
  double lost_motion_mm{};  // of each axis: the body follows its encoder when that has taken it up
  double hysteresis_mm{};   // of the probe: its deflection lags by half of it
  double gain_bend{};       // share by which the gain is larger at the overtravel than at zero
  double lobing_mm{};       // three lobes about Z
  double overtravel_mm{0.5};
  double clearance_mm{0.6};
  double acceleration_mm_s2{20000.0};
  double dwell_s{0.02};
  std::vector<double> speeds_mm_s{5.0, 10.0, 20.0, 30.0, 40.0};
  std::vector<Eigen::Vector3d> normals{{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}};
  double approach_rad{0.0};  // between drive and normal, in a random direction; the tip does not slide
  double radius_mm{15.5};    // effective; negative for touches from within, the normals pointing inwards
  Eigen::Vector3d centre_mm{0.0, 0.0, 0.0};
  Eigen::Matrix3d gain{Eigen::Matrix3d::Identity()};  // A of (A3)
  // Of a machine with three joints: their positions for a place of the tip; the machine's rows then hold those.
  std::function<Eigen::Vector3d(const Eigen::Vector3d&)> inverse{};
  Eigen::Vector3d sigma_share{1.0, 1.0, 1.0};  // noise of each component of the machine, per machine_sigma_mm
  double machine_delay_s{0.004};
  Eigen::Vector3d more_delay_s{0.0, 0.0, 0.0};  // of the axes or joints, each
  double probe_delay_s{0.0001};

  double tau() const { return machine_delay_s - probe_delay_s; }
  double tauOf(Eigen::Index axis) const { return tau() + more_delay_s[axis]; }
};

// A single speed, the size known, and what else the method says of its set-up.
Scene knownSphere();
Scene plates();
Scene perAxis();
Scene nonNormal();

Scene withoutNoise(Scene scene);

// The scene with other axis delays where there are any, another centre, coupled gain and delays.
Scene shuffled(Scene scene, std::mt19937_64& random);

// Touches of every normal at every speed, speed by speed, with the configuration of the method.
Dataset measure(const Scene& scene, std::mt19937_64& random);

// The same measurement on a machine that stands elsewhere, machine and probe turned together.
Dataset moved(Dataset dataset, const Eigen::Matrix3d& turn, const Eigen::Vector3d& shift);

// Reference precision: the Fisher matrix of (A12) with the uncertainty (A8) of the retract windows of metrology A.3.
struct Reference {
  double tau_sd_s{};        // of x where every axis has its own
  double diameter_sd_mm{};  // 0 where it is known
};
Reference referencePrecision(const Scene& scene);

}  // namespace probebox::metrology::simulation
