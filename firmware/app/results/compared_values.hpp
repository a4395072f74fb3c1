#pragma once
#include <optional>
#include <string>
#include <vector>

#include "firmware/store/record.hpp"

// Compares a result with the one in force of the same subject.
namespace probebox::app {

// A larger difference, in combined standard deviations, must be accepted explicitly.
inline constexpr double kMostSd = 4.0;

struct ComparedValue {
  std::string key;  // with unit and index: centre_mm[0], deviation_XC_at_60_deg_mm
  double value{};
  std::optional<double> sd;  // k = 1
  double before{};           // of the result in force
  std::optional<double> sd_before;
  std::optional<double> u{}, u_before{};  // combined standard uncertainties; sd where there are none

  double difference() const { return value - before; }
  // |difference| over the combined sd; nothing without any sd.
  std::optional<double> inSd() const;
  // Too far apart, or different and without an sd that could explain it.
  bool differs() const;
};

struct Comparison {
  store::Id with{};                   // the result in force; 0: none, this is the first about its subject
  std::vector<ComparedValue> values;  // those that both have, about the subject alone
  std::size_t omitted{};              // number of smaller differences that `values` omits

  bool first() const { return with == 0; }
  // True if a value differs, or the results have no value in common.
  bool differs() const;
};

// Compares `next` with `in_force`, both of one subject. Of two centrelines with heights the older one is evaluated at
// the height of the newer.
Comparison compare(const store::Record& next, const store::Record& in_force);

// Names the value whose uncertainty grows most, with numbers: "centre_mm[0] from 0.0004 to 0.0019"; nothing where none
// grows by half.
std::optional<std::string> lessCertain(const Comparison& comparison);

// Names the values that differ, with numbers: "centre_mm[0] 0.168 instead of 0.154 (+0.014, 180 sd)".
std::string differencesIn(const Comparison& comparison);

}  // namespace probebox::app
