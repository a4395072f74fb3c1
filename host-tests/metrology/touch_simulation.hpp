#pragma once
#include <Eigen/Core>
#include <functional>
#include <random>
#include <string>
#include <vector>

#include "firmware/metrology/dataset/dataset.hpp"

namespace probebox::metrology::simulation {

// What a machine and its probe err by, beyond delay and noise.
struct MachineErrors {
  Eigen::Vector3d lost_motion_mm{0.0, 0.0, 0.0};            // play between encoder and body of each axis
  Eigen::Vector3d drift_mm_min{0.0, 0.0, 0.0};              // of what is touched
  double scatter_mm{};                                      // sd of each way of a touch along the normal
  std::function<double(const Eigen::Vector3d&)> form_mm{};  // outwards, by the normal
  double hysteresis_mm{};                                   // of the probe
  Eigen::Vector3d zero_drift_mm_min{0.0, 0.0, 0.0};
  Eigen::Vector3d curvature_per_mm{0.0, 0.0, 0.0};  // share by which a channel reads too much, per mm of it
  // A vibration of body and encoders, and one of the probe's zero.
  double axes_hz{}, probe_hz{};
  Eigen::Vector3d axes_amplitude_mm{0.0, 0.0, 0.0}, probe_amplitude_mm{0.0, 0.0, 0.0};
};

// One touch of a run: where, and how fast.
struct Visit {
  Eigen::Vector3d normal;
  double speed_mm_s;
};

// A machine that touches a datum sphere, two parallel faces, a bore or a cube: motion, contact and both streams in
// time. It knows nothing of windows or lines.
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
  double overtravel_mm{0.5};
  double clearance_mm{0.6};
  double acceleration_mm_s2{20000.0};
  double dwell_s{0.02};
  std::vector<double> speeds_mm_s{5.0, 10.0, 20.0, 30.0, 40.0};
  std::vector<Eigen::Vector3d> normals{{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}};
  double approach_rad{0.0};  // between drive and normal, in a random direction; the tip does not slide
  double radius_mm{15.5};    // effective; negative for touches from within, the normals pointing inwards
  Eigen::Vector3d half_edges_mm{0.0, 0.0, 0.0};  // of a box in its place, effective
  Eigen::Vector3d aim_mm{0.0, 0.0, 0.0};         // by which drives pass the middle of a flat face, across its normal
  Eigen::Vector3d centre_mm{0.0, 0.0, 0.0};
  Eigen::Matrix3d gain{Eigen::Matrix3d::Identity()};  // A of (A3)
  // Of a machine with three joints: their positions for a place of the tip; the machine's rows then hold those.
  std::function<Eigen::Vector3d(const Eigen::Vector3d&)> inverse{};
  Eigen::Vector3d sigma_share{1.0, 1.0, 1.0};  // noise of each component of the machine, per machine_sigma_mm
  double machine_delay_s{0.004};
  Eigen::Vector3d more_delay_s{0.0, 0.0, 0.0};  // of the axes or joints, each
  double probe_delay_s{0.0001};
  MachineErrors errors{};
  std::vector<Visit> visits{};  // in place of every normal at every speed
  double every_s{};             // from one touch to the next; 0: the time of each touch counts from its beginning

  double tau() const { return machine_delay_s - probe_delay_s; }
  double extent_mm(const Eigen::Vector3d& normal) const {
    return half_edges_mm.isZero() ? radius_mm : half_edges_mm.dot(normal.cwiseAbs());
  }
  double tauOf(Eigen::Index axis) const { return tau() + more_delay_s[axis]; }
};

// A single speed, the size known, and what else the method says of its set-up.
Scene knownSphere();
Scene plates();
Scene bore();
Scene cube();  // with edges that differ, beside whose middles the drives go
Scene perAxis();
Scene nonNormal();
// One point, without a dwell and a bounce.
Scene inOut();
// The axes' sides first, in the middle and last, with the 25 directions of ISO 10360-5 between, each at two speeds.
Scene machineCheck();

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
