#pragma once
#include <Eigen/Core>
#include <string>
#include <vector>

#include "firmware/metrology/dataset/dataset.hpp"
#include "firmware/metrology/dataset/result.hpp"
#include "firmware/metrology/fit/robust_statistics.hpp"
#include "firmware/metrology/scan/feature_distance.hpp"
#include "protocol/units/outcome.hpp"

namespace probebox::metrology {

// One scan along a feature, in contact all the way.
struct ContourScan {
  std::string name;
  double speed_mm_s{};
  Signal distance;                          // mm, machine from the stated feature
  Signal deflection;                        // mm
  std::vector<std::vector<double>> places;  // at the machine's stamps: error of the distance per mm of displacement of
                                            // the feature, along each direction to which the scan is sensitive
  std::vector<std::string> spikes;          // samples that were removed: no motion
  std::vector<double> step;                 // mm: the distance without its mean and its projection on `places`
};

struct ScanQuestion {
  FeatureDistance feature;
  Eigen::Matrix3d gain{Eigen::Matrix3d::Identity()};
  double window_s{};               // of the search for the delay
  std::string varies{"distance"};  // name of the quantity that must change, for messages; or "radius"
  bool in_circles{};               // about the feature, so that a scan repeats itself
};

// Reads search_window_s. Refuses: missing-key, bad-config, window-too-small.
Outcome<double, Refusal> searchWindow(const Dataset& dataset);

// Reads the scans of the tables machine, probe and scans, in the order of the last. Refuses what checkedTable refuses,
// and: unknown-scan, bad-speed, speed-differs (from the nominal by more than 20 % of a circle, 40 % of another path),
// too-few-samples (fifty), time-not-rising, gap (a span of ten times what the samples cover), duplicated-reading (two
// scans with the same samples), contact-lost, constant-distance or constant-radius (squared rate under ten times its
// noise), window-too-large (half a turn, or half a scan).
Outcome<std::vector<ContourScan>, Refusal> readScans(const Dataset& dataset, const ScanQuestion& question);

// Finds the delay with the highest correlation of the rates of distance and deflection in the search window (A13), s,
// refined by a parabola. Refuses: rival-peak (another above 0.6 of it, or steps that repeat within twice the window),
// no-peak.
Outcome<double, Refusal> coarseDelay(const std::vector<ContourScan>& scans, double window_s);

}  // namespace probebox::metrology
