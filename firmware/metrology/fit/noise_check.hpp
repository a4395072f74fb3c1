#pragma once
#include <Eigen/Core>
#include <optional>
#include <string>
#include <string_view>

#include "firmware/metrology/dataset/result.hpp"
#include "firmware/metrology/fit/chi_square.hpp"

namespace probebox::metrology {

// Stable names that begin a warning about noise, for programs.
inline constexpr std::string_view kResidualsExceedNoise = "residuals-exceed-noise";
inline constexpr std::string_view kResidualsBelowNoise = "residuals-below-noise";
inline constexpr std::string_view kResidualsShowAPattern = "residuals-show-a-pattern";

// What residuals are compared with where no sigma is stated.
inline constexpr std::string_view kNoiseOfSamples = "the noise of the samples within each touch";

// Residuals against the noise that they were weighted with.
struct NoiseCheck {
  double chi2_reduced{};
  ChiSquareLaw law;
  std::string_view warning;  // one of the names above; empty where the residuals agree with the noise
  double widening{1.0};      // factor on the sd: the Birge ratio for unknown noise, else 1

  // Writes chi-square, its degrees of freedom and the warning into the result. noise: "the stated sigma".
  void report(Result& result, std::string_view noise) const;
};

// Keys of Result::also: the degrees of freedom of chi2_reduced, and of the noise it is counted in where that was
// learned.
inline constexpr std::string_view kChiSquareDof = "chi2_dof";
inline constexpr std::string_view kNoiseDof = "noise_dof";

// Range that 99.9 % of honest readings are in. Its lower end is 0 below four degrees of freedom: so few readings of few
// digits agree exactly by chance.
ChiSquareRange expectedRange(const ChiSquareLaw& law);

// The law of the result's chi2_reduced; nothing where it has none, or is of a version that did not say.
std::optional<ChiSquareLaw> lawOf(const Result& result);

// Compares a reduced chi-square with its 99.9 % range. residuals: weighted, in the order of the readings, to tell
// unknown noise from a wrong model, whose neighbouring residuals have equal signs: a wider sd is no remedy for that
// one. Nothing is found without degrees of freedom.
NoiseCheck checkNoise(double chi2_reduced, const ChiSquareLaw& law, const Eigen::VectorXd& residuals);

// Whether neighbouring residuals have equal signs more often than chance explains (one-sided, 0.1 %). Rows one to six
// apart are compared, because a reading has up to six coordinates. dof: residuals of a fit with few of them are alike
// without any pattern.
bool showPattern(const Eigen::VectorXd& residuals, std::size_t dof);

}  // namespace probebox::metrology
