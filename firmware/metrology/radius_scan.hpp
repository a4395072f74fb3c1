#pragma once
#include <Eigen/Core>
#include <string>
#include <vector>

#include "firmware/metrology/dataset.hpp"
#include "firmware/metrology/result.hpp"
#include "firmware/metrology/signal.hpp"
#include "protocol/units/outcome.hpp"

namespace probebox::metrology {

// One scan about a sphere, in contact all the way.
struct RadiusScan {
  std::string name;
  double speed_mm_s{};
  Signal radius;               // mm, machine from the stated centre
  Signal deflection;           // mm
  std::vector<double> cosine;  // of the angle about the centre, at the machine's stamps
  std::vector<double> sine;
  std::vector<double> step;  // mm: the radius less its mean and first harmonic, which an error of the centre looks like
};

struct ScanConfig {
  Eigen::Vector3d centre;
  Eigen::Matrix3d gain{Eigen::Matrix3d::Identity()};
  double window_s{};  // of the search for the delay
};

// Config keys centre_mm, search_window_s, gain_matrix. Refuses: bad-config, missing-key, window-too-small.
Outcome<ScanConfig, Refusal> readScanConfig(const Dataset& dataset);

// The scans of the tables machine, probe and scans, in the order of the last. Refuses what checkedTable refuses, and:
// unknown-scan, bad-speed, too-few-samples (fifty), time-not-rising, duplicated-reading (two scans with the same
// samples), contact-lost, constant-radius (squares of the rate of the radius under ten times those of its noise),
// window-too-large (half a turn).
Outcome<std::vector<RadiusScan>, Refusal> readScans(const Dataset& dataset, const ScanConfig& config);

// Where the rates of radius and deflection match best (A13), s: the highest peak of their correlation over the search
// window, refined by a parabola through the three topmost values. Refuses: rival-peak (another above 0.6 of it, or
// steps that repeat within twice the window), no-peak.
Outcome<double, Refusal> coarseDelay(const std::vector<RadiusScan>& scans, double window_s);

}  // namespace probebox::metrology
