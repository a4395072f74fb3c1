#pragma once
#include <cstddef>

namespace probebox::metrology {

// Distribution of a reduced chi-square of Gaussian residuals: chi-square over its degrees of freedom where the noise is
// stated (noise_dof 0), Fisher's F where it was itself learned from noise_dof other residuals.
struct ChiSquareLaw {
  std::size_t dof{};
  std::size_t noise_dof{};

  double probabilityBelow(double reduced) const;
  double probabilityAbove(double reduced) const;
};

// Probability that honest noise leaves the range, both sides together.
inline constexpr double kFalseAlarm = 0.001;

struct ChiSquareRange {
  double low{};
  double high{};
};

// The two-sided 99.9 % range, with equal probability outside on both sides. dof: at least 1.
ChiSquareRange rangeOf(const ChiSquareLaw& law);

}  // namespace probebox::metrology
