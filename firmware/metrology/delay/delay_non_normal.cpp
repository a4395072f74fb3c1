#include "firmware/metrology/delay/delay_non_normal.hpp"

#include <array>

#include "firmware/metrology/dataset/configuration.hpp"
#include "firmware/metrology/delay/delay_method.hpp"
#include "firmware/metrology/touch/one_speed.hpp"
#include "firmware/metrology/touch/touch_delay.hpp"

namespace probebox::metrology {
namespace {

// Reduced chi-square of the slopes against one gain. A tip that slides does not follow a good part of the motion, which
// is thousands; a gain that differs a little between directions is not meant.
constexpr double kSlip = 25.0;

}  // namespace

Outcome<Result, Refusal> solveDelayNonNormal(const Dataset& dataset) {
  TRY(const auto diameter, configPositive(dataset, "effective_diameter_mm"));
  TRY(const auto measured, TouchDelay::measure(dataset, {.size_mm = diameter}));
  // A gain of each touch assumes that the deflection follows the motion: a tip that slides off it would pass unseen.
  if (measured.touches().gain_misfit > kSlip) {
    return Refusal{"tip-slip",
                   "no gain matrix fits the deflections of all touches: the tip slid on the surface, or the stamps of "
                   "a touch are off; touch closer to "
                   "the normal, or on a rougher surface"};
  }
  return measured.onSphere();
}

namespace {

constexpr MethodKey kNonNormalKeys[]{of_delay::kDiameter,
                                     of_delay::kFeature,
                                     of_delay::kLostMotion,
                                     of_delay::kPreviousTau,
                                     kProbeA,
                                     key::kASense,
                                     kProbeB};
constexpr Quantity kNonNormalResults[]{quantity::kTau, quantity::kCentre};

}  // namespace

const Method kDelayNonNormal{.name = "delay-non-normal",
                             .title = "System delay from touches off the normal",
                             .equations = "(A1)-(A7b), (A12)",
                             .source = source::kDelay,
                             .solver = solveDelayNonNormal,
                             .tables = of_delay::kTouchTables,
                             .keys = kNonNormalKeys,
                             .known = of_delay::kDiameterKnown,
                             .results = kNonNormalResults,
                             .further = of_delay::kFurther,
                             .unobservable = of_delay::kOneForAllAxes,
                             .undetermined = lostMotionAtOneSpeed,
                             .subject = of_delay::kSubject};

}  // namespace probebox::metrology
