#include "firmware/metrology/delay/delay_known_sphere.hpp"

#include <array>

#include "firmware/metrology/dataset/configuration.hpp"
#include "firmware/metrology/delay/delay_method.hpp"
#include "firmware/metrology/touch/one_speed.hpp"
#include "firmware/metrology/touch/touch_delay.hpp"

namespace probebox::metrology {
Outcome<Result, Refusal> solveDelayKnownSphere(const Dataset& dataset) {
  TRY(const auto diameter, requiredPositive(dataset, "effective_diameter_mm"));
  TRY(const auto measured, TouchDelay::measure(dataset, {.size_mm = diameter}));
  Result result = measured.report();
  result.estimates.push_back(measured.delay());
  if (const auto centre = measured.centre()) result.estimates.push_back(*centre);
  result.covariance = measured.covarianceOf(result.estimates);
  if (const auto gain = measured.gainMatrix()) result.estimates.push_back(*gain);
  if (measured.touches().whole) result.also.push_back(measured.size());
  if (auto refusal = measured.addSizeCheck(result)) return *refusal;
  return result;
}

namespace {

constexpr MethodKey kKnownSphereKeys[]{{"effective_diameter_mm", kNeeded, "of sphere plus stylus ball"},
                                       of_delay::kFeature,
                                       of_delay::kLostMotion,
                                       of_delay::kPreviousTau,
                                       kProbeA,
                                       key::kASense,
                                       kProbeB};
constexpr Quantity kKnownSphereResults[]{quantity::kTau, quantity::kCentre, quantity::kGainMatrix};

}  // namespace

const Method kDelayKnownSphere{.name = "delay-known-sphere",
                               .title = "System delay from a sphere of known size",
                               .equations = "(A1)-(A7b), (A12)",
                               .source = source::kDelay,
                               .solver = solveDelayKnownSphere,
                               .tables = of_delay::kTouchTables,
                               .keys = kKnownSphereKeys,
                               .known = of_delay::kDiameterKnown,
                               .results = kKnownSphereResults,
                               .further = of_delay::kFurther,
                               .unobservable = of_delay::kOneForAllAxes,
                               .undetermined = lostMotionAtOneSpeed,
                               .subject = of_delay::kSubject};

}  // namespace probebox::metrology
