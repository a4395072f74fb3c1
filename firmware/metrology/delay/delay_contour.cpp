#include "firmware/metrology/delay/delay_contour.hpp"

#include <array>

#include "firmware/metrology/dataset/configuration.hpp"
#include "firmware/metrology/delay/delay_method.hpp"
#include "firmware/metrology/scan/contour_match.hpp"

namespace probebox::metrology {
Outcome<Result, Refusal> solveDelayContour(const Dataset& dataset) {
  if (auto refusal = refuseTurnedProbe(dataset)) return *refusal;
  TRY(const auto feature, featureDistance(dataset));
  TRY(const auto window, searchWindow(dataset));
  TRY(const auto gain, configGain(dataset));
  return matchScans(dataset, {feature, gain, window});
}

namespace {

constexpr MethodKey kContourKeys[]{
    {"shape", kNeeded, "sphere, cylinder, plane, plane-pair or box"},
    {"centre_mm", "", "nominal centre; needed unless shape is plane"},
    {"axis_direction", "",
     "axis of a cylinder, outward normal of a plane, normal of a pair of faces; needed for these shapes"},
    {"size_axis_mm", "", "size of a box along x y z; needed for this shape"},
    {"feature", "external", "external or internal"},
    of_delay::kSearchWindow,
    of_delay::kGain,
    of_delay::kPreviousTau,
    kProbeAtZero,
    kProbeB,
    of_delay::kProbeKind};
constexpr Quantity kContourResults[]{quantity::kTau};
constexpr std::string_view kContourUnobservable[]{
    of_delay::kApart, of_delay::kAfterStamps,
    "delays that differ between the axes; size and position of the feature: both are nuisance parameters of each scan",
    of_delay::kExactFeature};

}  // namespace

const Method kDelayContour{.name = "delay-contour",
                           .title = "System delay from scans along any feature",
                           .equations = "(A1), (A13)-(A17), (A22)",
                           .source = source::kDelay,
                           .solver = solveDelayContour,
                           .tables = of_delay::kScanTables,
                           .keys = kContourKeys,
                           .results = kContourResults,
                           .unobservable = kContourUnobservable,
                           .subject = of_delay::kSubject};

}  // namespace probebox::metrology
