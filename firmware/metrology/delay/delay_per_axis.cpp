#include "firmware/metrology/delay/delay_per_axis.hpp"

#include <array>

#include "firmware/metrology/dataset/configuration.hpp"
#include "firmware/metrology/delay/delay_method.hpp"
#include "firmware/metrology/touch/one_speed.hpp"
#include "firmware/metrology/touch/touch_delay.hpp"

namespace probebox::metrology {
Outcome<Result, Refusal> solveDelayPerAxis(const Dataset& dataset) {
  TRY(const auto diameter, configPositive(dataset, "effective_diameter_mm"));
  TRY(const auto measured, TouchDelay::measure(dataset, {.delays = Delays::each_axis, .size_mm = diameter}));
  return measured.onSphere();
}

namespace {

constexpr MethodKey kPerAxisKeys[]{of_delay::kDiameter,
                                   of_delay::kFeature,
                                   of_delay::kLostMotion,
                                   of_delay::kPreviousTauAxis,
                                   kProbeA,
                                   key::kASense,
                                   kProbeB};
constexpr Quantity kPerAxisResults[]{quantity::kTauAxis, quantity::kCentre};

}  // namespace

const Method kDelayPerAxis{.name = "delay-per-axis",
                           .title = "System delay of each axis",
                           .equations = "(A1)-(A7b), (A12)",
                           .source = source::kDelay,
                           .solver = solveDelayPerAxis,
                           .tables = of_delay::kTouchTables,
                           .keys = kPerAxisKeys,
                           .known = of_delay::kDiameterKnown,
                           .results = kPerAxisResults,
                           .further = of_delay::kFurther,
                           .unobservable = of_delay::kAnyDelay,
                           .undetermined = lostMotionAtOneSpeed,
                           .subject = of_delay::kSubject};

}  // namespace probebox::metrology
