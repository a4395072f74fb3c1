#pragma once
#include <cstddef>
#include <optional>
#include <string>
#include <string_view>

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

// Twice the logarithm of a likelihood ratio of 50: explanations less apart are about as likely.
inline constexpr double kAsLikely = 8;

struct ChiSquareRange {
  double low{};
  double high{};
};

// The two-sided 99.9 % range, with equal probability outside on both sides. dof: at least 1.
ChiSquareRange rangeOf(const ChiSquareLaw& law);

// Variance of a reading by the residuals of its own fit, where no sigma is stated: s^2 n/(n - 2) with n degrees of
// freedom, so that errors in units of the sd have the variance 1 (Student's t; JCGM 101, 6.4.9.4). Nothing up to two
// degrees, where t has no variance.
std::optional<double> varianceFromResiduals(double sum_of_squares, std::size_t dof);

// Explains why there is no sd. key: "sigma_mm".
std::string noSdWarning(std::size_t dof, std::string_view key);

}  // namespace probebox::metrology
