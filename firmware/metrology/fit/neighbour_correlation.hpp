#pragma once
#include <functional>

namespace probebox::metrology {

// Correlation of neighbouring samples, as by a filter, a time constant or vibration: r, and r^m at m samples.
struct NeighbourCorrelation {
  double r{};       // 0 where chance explains it (two deviations)
  bool is_clear{};  // by three deviations
  // Factor on the variance of a long sum of samples, for independent ones 1.
  double inflation() const { return (1.0 + r) / (1.0 - r); }
};

// The r, at most 0.95, for which `expected`, rising with r, is what was found. beyond: by how many deviations that is
// more than independent samples have.
NeighbourCorrelation neighbourCorrelation(double found, double beyond, const std::function<double(double)>& expected);

}  // namespace probebox::metrology
