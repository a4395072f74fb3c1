#include "firmware/metrology/delay/delay_stepped_scan.hpp"

#include <array>

#include "firmware/metrology/dataset/configuration.hpp"
#include "firmware/metrology/delay/delay_method.hpp"
#include "firmware/metrology/scan/contour_match.hpp"

namespace probebox::metrology {
Outcome<Result, Refusal> solveDelaySteppedScan(const Dataset& dataset) {
  if (auto refusal = refuseTurnedProbe(dataset)) return *refusal;
  TRY(const auto centre, requiredVector(dataset, "centre_mm"));
  TRY(const auto window, searchWindow(dataset));
  TRY(const auto gain, configGain(dataset));
  const FeatureDistance sphere{.centre = Eigen::Vector3d{centre.data()}};
  return matchScans(dataset, {sphere, gain, window, "radius", true});
}

namespace {

constexpr MethodKey kSteppedScanKeys[]{{"centre_mm", kNeeded, "centre of the sphere; may be off by 0.2 mm"},
                                       of_delay::kSearchWindow,
                                       of_delay::kGain,
                                       of_delay::kPreviousTau,
                                       of_delay::kProbeKind,
                                       kProbeAtZero,
                                       kProbeB,
                                       {"effective_radius_mm", "", "of sphere plus stylus ball; for the record"},
                                       {"r1_mm", "", "one commanded radius; for the record"},
                                       {"r2_mm", "", "the other commanded radius; for the record"},
                                       {"arcs_rad", "", "lengths of the arcs between steps; for the record"},
                                       {"centre_is_approximate", "", "for the record: the centre is always fitted"}};
constexpr Quantity kSteppedScanResults[]{quantity::kTau};
constexpr std::string_view kSteppedScanUnobservable[]{
    of_delay::kApart, of_delay::kAfterStamps,
    "delays that differ between the axes, and the radius: both are nuisance parameters of each scan"};

}  // namespace

const Method kDelaySteppedScan{.name = "delay-stepped-scan",
                               .title = "System delay from scans with steps of the radius",
                               .equations = "(A1), (A13)-(A17)",
                               .source = source::kDelay,
                               .solver = solveDelaySteppedScan,
                               .tables = of_delay::kScanTables,
                               .keys = kSteppedScanKeys,
                               .results = kSteppedScanResults,
                               .unobservable = kSteppedScanUnobservable,
                               .subject = of_delay::kSubject};

}  // namespace probebox::metrology
