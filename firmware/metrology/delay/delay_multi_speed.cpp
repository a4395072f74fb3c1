#include "firmware/metrology/delay/delay_multi_speed.hpp"

#include <array>
#include <cmath>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "firmware/metrology/dataset/configuration.hpp"
#include "firmware/metrology/delay/delay_method.hpp"
#include "firmware/metrology/touch/touch_delay.hpp"

namespace probebox::metrology {
namespace {

constexpr Quantity kStaticError{
    .key = "static_error_mm",
    .about = "the measured effective diameter minus the certified one; only if that is given",
    .kind = QuantityKind::error};
// Sizes at the nominal speeds, for a picture of the line of (A10).
void addSizes(Result& result, const std::vector<Retract>& retracts, const TouchFit& fit) {
  std::map<double, std::vector<double>> sizes;
  for (std::size_t i = 0; i < retracts.size(); ++i) {
    const auto row = static_cast<Eigen::Index>(i);
    const double size = fit.size_mm + 2.0 * (fit.radial[row] - fit.tau_s[0] * fit.normal_speed[row]);
    sizes[retracts[i].plan.speed_mm_s].push_back(size);
  }
  std::vector<double> speeds;
  std::vector<double> means;
  for (const auto& [speed, of_speed] : sizes) {
    speeds.push_back(speed);
    double sum = 0.0;
    for (const double size : of_speed) sum += size;
    means.push_back(sum / static_cast<double>(of_speed.size()));
  }
  result.also.push_back(Estimate::vector("speeds_mm_s", speeds, {}));
  result.also.push_back(Estimate::vector("sizes_mm", means, {}));
}

// Nothing where the case does not say how well the size is known, or the sphere is as large as it says.
Outcome<std::optional<std::string>, Refusal> whyNotAsCertified(const Dataset& dataset, const Estimate& error) {
  constexpr double kMost_sd = 4;
  TRY(const auto of_sphere, configPositive(dataset, "sd_effective_diameter_mm"));
  TRY(const auto of_ball, configPositive(dataset, "sd_stylus_ball_diameter_mm"));
  const double u = std::hypot(error.sd.empty() ? 0 : error.sd.front(), of_sphere.value_or(0), of_ball.value_or(0));
  if ((!of_sphere && !of_ball) || std::abs(error.value()) <= kMost_sd * u) return std::optional<std::string>{};
  return std::optional{"static-error: sphere and stylus ball together measure " + text(error.value() * 1e3) +
                       " um more than stated, which is " + text(std::abs(error.value()) / u) +
                       " times its standard uncertainty: look for their temperature, the diameter in probe.toml and "
                       "the probe's threshold; a delay from the stated size would be wrong by as much"};
}

}  // namespace

Outcome<Result, Refusal> solveDelayMultiSpeed(const Dataset& dataset) {
  TRY(const auto known_size, configPositive(dataset, "effective_diameter_mm"));
  TRY(const auto measured, TouchDelay::measure(dataset, {}));
  const TouchFit& fit = measured.touches().fit;
  Result result = measured.report();
  const Estimate size = measured.size();
  result.estimates = {measured.delay(), size};
  if (known_size) {
    result.estimates.push_back(Estimate::scalar(kStaticError, size.value() - *known_size, size.standardDeviation()));
    result.estimates.back().design = size.design;
    TRY(const auto warning, whyNotAsCertified(dataset, result.estimates.back()));
    if (warning) result.warnings.push_back(*warning);
  }
  if (const auto centre = measured.centre()) result.also.push_back(*centre);
  if (const auto gain = measured.gainMatrix()) result.also.push_back(*gain);
  addSizes(result, measured.touches().retracts, fit);
  result.covariance = measured.covarianceOf(std::span{result.estimates}.first(2));
  return result;
}

namespace {

constexpr MethodKey kMultiSpeedKeys[]{
    {"effective_diameter_mm", "",
     "certified diameter of sphere plus stylus ball; if given, static_error_mm is answered too"},
    of_delay::kFeature,
    of_delay::kPreviousTau,
    kProbeA,
    key::kASense,
    kProbeB};
constexpr Quantity kMultiSpeedResults[]{quantity::kTau, quantity::kEffectiveDiameter, kStaticError};
constexpr std::string_view kMultiSpeedUnobservable[]{
    of_delay::kApart, of_delay::kAfterStamps, of_delay::kOneForAll,
    "the causes of the static error separately: size of the ball, threshold of the probe and form are one number"};

}  // namespace

const Method kDelayMultiSpeed{.name = "delay-multi-speed",
                              .title = "System delay from several speeds",
                              .equations = "(A1)-(A8), (A10), (A12)",
                              .source = source::kDelay,
                              .solver = solveDelayMultiSpeed,
                              .tables = of_delay::kTouchTables,
                              .keys = kMultiSpeedKeys,
                              .known = of_delay::kDiameterKnown,
                              .results = kMultiSpeedResults,
                              .unobservable = kMultiSpeedUnobservable,
                              .subject = of_delay::kSubject};

}  // namespace probebox::metrology
