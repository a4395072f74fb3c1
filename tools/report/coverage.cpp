#include "tools/report/coverage.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "firmware/metrology/fit/noise_check.hpp"

namespace probebox::report {
namespace {

constexpr double kInfinite = std::numeric_limits<double>::infinity();

// Those of the sd of the readings. Without spare readings it comes from the stated noise, or there is none.
double dofOfReadings(const metrology::Result& result) {
  if (!result.chi2_reduced) return result.dof == 0 ? kInfinite : static_cast<double>(result.dof);
  const auto* of_noise = result.find(metrology::kNoiseDof);
  return of_noise != nullptr ? of_noise->value() : kInfinite;
}

}  // namespace

double coverageProbability(double k, double dof) {
  constexpr double kAsNormal = 1e6;
  if (!(dof < kAsNormal)) return std::erf(k / std::numbers::sqrt2);
  // Simpson's rule over the density of t.
  constexpr int kSteps = 2000;
  const double scale = std::exp(std::lgamma((dof + 1) / 2) - std::lgamma(dof / 2)) / std::sqrt(dof * std::numbers::pi);
  const auto density = [&](double t) { return scale * std::pow(1 + t * t / dof, -(dof + 1) / 2); };
  const double step = k / kSteps;
  double sum = density(0) + density(k);
  for (int i = 1; i < kSteps; ++i) sum += (i % 2 == 1 ? 4 : 2) * density(i * step);
  return 2 * sum * step / 3;
}

double effectiveDof(const metrology::Result& result, const metrology::Estimate& estimate, std::size_t at) {
  const double dof = dofOfReadings(result);
  if (at >= estimate.sd.size() || at >= estimate.uncertainty.size()) return dof;
  const double type_a = estimate.sd[at];
  // Rounding may leave the uncertainty a digit below its own part.
  return type_a > 0 ? dof * std::pow(std::max(1.0, estimate.uncertainty[at] / type_a), 4) : kInfinite;
}

}  // namespace probebox::report
