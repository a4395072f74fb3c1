#include "tools/report/coverage.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "firmware/metrology/fit/noise_check.hpp"

namespace probebox::report {
namespace {

constexpr double kInfinite = std::numeric_limits<double>::infinity();

// sd of Student's t in its s.
double widthOf(double dof) {
  return dof > 2 && std::isfinite(dof) ? std::sqrt(dof / (dof - 2)) : 1;
}

// The share of the readings in the sd of a value, which holds the stops of axes that stood still too: no scatter shows
// those. Where the budget does not say, the sd.
double readingsSd(const metrology::Result& result, const metrology::Estimate& estimate, std::size_t at) {
  const auto readings = std::ranges::find(result.budget, false, &metrology::Contribution::type_b);
  if (readings == result.budget.end()) return estimate.sd[at];
  std::size_t from = 0;
  for (const auto& each : result.estimates) {
    if (each.key == estimate.key) return from + at < readings->sd.size() ? readings->sd[from + at] : estimate.sd[at];
    from += each.values.size();
  }
  return estimate.sd[at];
}

// The combined uncertainty with type A as s, in s. Rounding may leave the uncertainty a digit below its own part.
double combinedInS(double dof, double u, double readings) {
  const double others = std::max(0.0, std::pow(u / readings, 2) - 1);
  return std::sqrt(1 + others * std::pow(widthOf(dof), 2));
}

}  // namespace

double readingsDof(const metrology::Result& result) {
  if (!result.chi2_reduced) return result.dof == 0 ? kInfinite : static_cast<double>(result.dof);
  const auto* of_noise = result.find(metrology::kNoiseDof);
  if (of_noise == nullptr) return kInfinite;
  return of_noise->value() >= 1.0 ? of_noise->value() : 1.0;  // an answer that was read from a file may say anything
}

std::string dofText(double dof) {
  constexpr double kMany = 1000;
  return dof < kMany ? std::to_string(static_cast<long>(std::floor(dof))) : "\u221e";
}

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
  const double dof = readingsDof(result);
  if (at >= estimate.sd.size() || at >= estimate.uncertainty.size()) return dof;
  const double readings = readingsSd(result, estimate, at);
  if (!(readings > 0)) return kInfinite;
  return dof * std::pow(combinedInS(dof, estimate.uncertainty[at], readings), 4);
}

double coverageOf(const metrology::Result& result, const metrology::Estimate& estimate, std::size_t at, double k) {
  const double dof = readingsDof(result), effective = effectiveDof(result, estimate, at);
  const bool is_known = at < estimate.sd.size() && at < estimate.uncertainty.size();
  const double readings = is_known ? readingsSd(result, estimate, at) : 0;
  if (!std::isfinite(dof) || !(readings > 0)) return coverageProbability(k, std::floor(effective));
  const double u = estimate.uncertainty[at], s = readings / widthOf(dof);
  return coverageProbability(k * std::max(u, estimate.sd[at]) / (s * combinedInS(dof, u, readings)),
                             std::floor(effective));
}

}  // namespace probebox::report
