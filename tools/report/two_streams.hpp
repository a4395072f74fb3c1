#pragma once
#include <optional>
#include <string>
#include <vector>

#include "firmware/metrology/dataset/dataset.hpp"

namespace probebox::report {

// One touch or scan of a case as two signals: how far the machine is along the way, and how far the probe is deflected.
struct TwoStreams {
  std::string name;  // "touch 7"
  std::vector<double> machine_s;
  std::vector<double> machine_mm;  // along the retract, or from the scanned feature (from the centre of a sphere)
  std::vector<double> probe_s;
  std::vector<double> probe;  // in the probe's units, positive in contact
  double axis_share[3]{};     // squares of the direction: how much of each axis' delay is seen
  bool whole_contact{};       // a touch: the contact has a beginning and an end
};

// Of the fastest touch, or the first scan; nothing where the tables are not there or hold too little.
std::optional<TwoStreams> twoStreams(const metrology::Dataset& dataset);

// Value at a time by lines between the samples; nothing outside them.
std::optional<double> valueAt(const std::vector<double>& times, const std::vector<double>& values, double t);

}  // namespace probebox::report
