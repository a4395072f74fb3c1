#pragma once
#include <optional>
#include <string>
#include <vector>

#include "firmware/metrology/dataset/dataset.hpp"

namespace probebox::report {

// One touch or scan of a case as two signals against time: position of the machine and deflection of the probe.
struct TwoStreams {
  std::string name;  // "touch 7"
  std::vector<double> machine_s;
  std::vector<double> machine_mm;  // along the retract, or from the scanned feature (from the centre of a sphere)
  std::vector<double> probe_s;
  std::vector<double> probe;  // in the probe's units, positive in contact
  double axis_share[3]{};     // squared components of the direction: weight of each axis' delay
  bool whole_contact{};       // a touch, whose contact begins and ends within the data
};

// Takes the fastest touch or the first scan; nothing if the tables are missing or too short.
std::optional<TwoStreams> twoStreams(const metrology::Dataset& dataset);

// Interpolates linearly between samples; nothing outside them.
std::optional<double> valueAt(const std::vector<double>& times, const std::vector<double>& values, double t);

}  // namespace probebox::report
