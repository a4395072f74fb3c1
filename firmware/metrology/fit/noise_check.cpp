#include "firmware/metrology/fit/noise_check.hpp"

#include <algorithm>
#include <cmath>

#include "firmware/metrology/dataset/configuration.hpp"

namespace probebox::metrology {
namespace {

// With fewer, rounding of the readings makes residuals exactly zero more often than noise does.
constexpr std::size_t kLeastForBelow = 4;
constexpr Eigen::Index kMostCoordinates = 6;
// Normal deviate that chance exceeds with 0.1 % / 6.
constexpr double kUnlikely = 3.59;

std::string remedyOf(const NoiseCheck& check) {
  if (check.warning == kResidualsBelowNoise) {
    return "the sd may be too large, and is left as it is; state the sigma that this machine and probe have, and check "
           "that no reading is a copy of another";
  }
  if (check.warning == kResidualsShowAPattern) {
    return "neighbouring readings deviate to the same side, so the model does not hold and the sd, which is not "
           "widened, does not cover it; look at the residuals, and check the feature's form, the stated sizes and "
           "whether something moved";
  }
  return "the sd is multiplied by " + text(check.widening) +
         "; look for an outlier, dirt or a loose part, or state the sigma that this machine and probe have";
}

}  // namespace

bool showPattern(const Eigen::VectorXd& residuals, std::size_t dof) {
  if (dof == 0) return false;
  const double rows_per_dof = static_cast<double>(residuals.size()) / static_cast<double>(dof);
  for (Eigen::Index apart = 1; apart <= kMostCoordinates; ++apart) {
    const Eigen::Index pairs = residuals.size() - apart;
    if (pairs < 1) return false;
    const auto alike = (residuals.head(pairs).array() * residuals.tail(pairs).array() > 0.0).count();
    const auto n = static_cast<double>(pairs);
    if (2.0 * static_cast<double>(alike) - n > kUnlikely * std::sqrt(n * rows_per_dof)) return true;
  }
  return false;
}

ChiSquareRange expectedRange(const ChiSquareLaw& law) {
  ChiSquareRange range = rangeOf(law);
  if (law.dof < kLeastForBelow) range.low = 0.0;
  return range;
}

NoiseCheck checkNoise(double chi2_reduced, const ChiSquareLaw& law, const Eigen::VectorXd& residuals) {
  NoiseCheck check{.chi2_reduced = chi2_reduced, .law = law, .warning = {}};
  if (law.dof == 0 || !std::isfinite(chi2_reduced)) return check;
  const bool can_be_below = law.dof >= kLeastForBelow;
  if (can_be_below && law.probabilityBelow(chi2_reduced) < kFalseAlarm / 2.0) check.warning = kResidualsBelowNoise;
  if (law.probabilityAbove(chi2_reduced) < kFalseAlarm / 2.0) {
    const bool pattern = showPattern(residuals, law.dof);
    check.warning = pattern ? kResidualsShowAPattern : kResidualsExceedNoise;
    if (!pattern) check.widening = std::sqrt(chi2_reduced);
  }
  return check;
}

std::optional<ChiSquareLaw> lawOf(const Result& result) {
  const Estimate* dof = result.find(kChiSquareDof);
  const Estimate* noise_dof = result.find(kNoiseDof);
  if (!result.chi2_reduced || dof == nullptr || !(dof->value() >= 1.0)) return std::nullopt;
  // A result that was read from a file may say anything.
  const auto count = [](double value) {
    constexpr double kMost = 1e15;
    return static_cast<std::size_t>(std::clamp(value, 0.0, kMost));
  };
  const double learned = noise_dof == nullptr || std::isnan(noise_dof->value()) ? 0.0 : noise_dof->value();
  return ChiSquareLaw{count(dof->value()), count(learned)};
}

void NoiseCheck::report(Result& result, std::string_view noise) const {
  if (law.dof == 0) return;
  result.chi2_reduced = chi2_reduced;
  const auto also = [&](std::string_view key, std::size_t dof) {
    result.also.push_back(Estimate::scalar(std::string{key}, static_cast<double>(dof), std::nullopt));
  };
  also(kChiSquareDof, law.dof);
  if (law.noise_dof > 0) also(kNoiseDof, law.noise_dof);
  if (warning.empty()) return;
  const auto [low, high] = expectedRange(law);
  result.warnings.push_back(std::string{warning} + ": the readings scatter " +
                            (warning == kResidualsBelowNoise ? "less than " : "more than ") + std::string{noise} +
                            " explains (reduced chi-square " + text(chi2_reduced) + " at " + std::to_string(law.dof) +
                            " degrees of freedom; 99.9 % of honest readings have " + text(low) + " to " + text(high) +
                            "): " + remedyOf(*this));
}

}  // namespace probebox::metrology
