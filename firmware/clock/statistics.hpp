#pragma once
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <span>

namespace probebox::clock {

// Standard deviation of normal values over their median absolute deviation.
inline constexpr double kMadToSigma = 1.4826;

// Median of a non-empty list. Reorders it.
inline double median(std::span<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

// Whether a setting is a number from low to high.
inline bool isWithin(double value, double low, double high) {
  return std::isfinite(value) && value >= low && value <= high;
}

}  // namespace probebox::clock
