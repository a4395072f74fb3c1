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

}  // namespace

Outcome<Result, Refusal> solveDelayMultiSpeed(const Dataset& dataset) {
  TRY(const auto known_size, configPositive(dataset, "effective_diameter_mm"));
  TRY(const auto measured, TouchDelay::measure(dataset, {}));
  const TouchFit& fit = measured.touches().fit;
  Result result = measured.report();
  const Estimate size = measured.size();
  result.estimates = {measured.delay(), size};
  if (known_size) {
    result.estimates.push_back(*measured.staticError(*known_size));
    TRY(const auto warning, measured.whyNotAsStated(result.estimates.back()));
    if (warning) result.warnings.push_back(*warning);
  }
  if (const auto lost = measured.lostMotion()) result.also.push_back(*lost);
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
    of_delay::kLostMotion,
    of_delay::kPreviousTau,
    kProbeA,
    key::kASense,
    kProbeB};
constexpr Quantity kMultiSpeedResults[]{quantity::kTau, quantity::kEffectiveDiameter, quantity::kStaticError};
constexpr std::string_view kMultiSpeedUnobservable[]{
    of_delay::kApart, of_delay::kAfterStamps, of_delay::kOneForAll,
    "the causes of the static error separately: size of the ball, threshold of the probe and form are one number"};

}  // namespace

const Method kDelayMultiSpeed{.name = "delay-multi-speed",
                              .title = "System delay from several speeds",
                              .equations = "(A1)-(A7b), (A10), (A12)",
                              .source = source::kDelay,
                              .solver = solveDelayMultiSpeed,
                              .tables = of_delay::kTouchTables,
                              .keys = kMultiSpeedKeys,
                              .known = of_delay::kDiameterKnown,
                              .results = kMultiSpeedResults,
                              .further = of_delay::kFurther,
                              .unobservable = kMultiSpeedUnobservable,
                              .subject = of_delay::kSubject};

}  // namespace probebox::metrology
