#pragma once
#include <Eigen/Core>
#include <optional>
#include <string>
#include <string_view>

#include "firmware/metrology/dataset/result.hpp"
#include "firmware/metrology/fit/chi_square.hpp"

namespace probebox::metrology {

// Stable names that begin a warning about residuals, for programs.
inline constexpr std::string_view kResidualsExceedNoise = "residuals-exceed-noise";
inline constexpr std::string_view kResidualsBelowNoise = "residuals-below-noise";
inline constexpr std::string_view kResidualsShowAPattern = "residuals-show-a-pattern";
inline constexpr std::string_view kResidualsCorrelated = "residuals-correlated";
// Each other or their model; also the name of a refusal.
inline constexpr std::string_view kReadingsContradict = "readings-contradict";

// The noise that residuals are compared with if no sigma is stated.
inline constexpr std::string_view kNoiseOfSamples = "the noise of the samples within each touch";

// Result of comparing residuals with the noise that weighted them.
struct NoiseCheck {
  double chi2_reduced{};
  ChiSquareLaw law;
  std::string_view warning;  // one of the names above; empty where the residuals agree with the noise
  double widening{1.0};      // factor on the sd: the Birge ratio for unknown noise, else 1

  // Writes chi-square, its degrees of freedom and the warning into the result. noise: "the stated sigma".
  void report(Result& result, std::string_view noise) const;
};

// Keys of Result::also: degrees of freedom of chi2_reduced, and of the noise estimate that it is relative to, if the
// noise was estimated.
inline constexpr std::string_view kChiSquareDof = "chi2_dof";
inline constexpr std::string_view kNoiseDof = "noise_dof";

// Range of chi2_reduced for 99.9 % of cases with correctly stated noise. Its lower end is 0 below four degrees of
// freedom: so few readings with few digits may agree exactly by chance.
ChiSquareRange expectedRange(const ChiSquareLaw& law);

// Distribution of the result's chi2_reduced; nothing if it has none, or is of a version that did not state it.
std::optional<ChiSquareLaw> lawOf(const Result& result);

// Compares a reduced chi-square with its 99.9 % range. residuals: weighted, in the order of the readings, to tell
// unknown noise from a wrong model, whose neighbouring residuals have equal signs: a wider sd is no remedy for a wrong
// model. Finds nothing without degrees of freedom.
NoiseCheck checkNoise(double chi2_reduced, const ChiSquareLaw& law, const Eigen::VectorXd& residuals);

// True if neighbouring residuals have equal signs more often than chance explains (one-sided, 0.1 %). Compares rows one
// to six apart, because a reading has up to six coordinates. dof: with few degrees of freedom residuals are correlated
// without any pattern.
bool showPattern(const Eigen::VectorXd& residuals, std::size_t dof);

}  // namespace probebox::metrology
