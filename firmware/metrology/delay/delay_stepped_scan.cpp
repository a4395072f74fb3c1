#include "firmware/metrology/delay/delay_stepped_scan.hpp"

#include <array>

#include "firmware/metrology/dataset/configuration.hpp"
#include "firmware/metrology/dataset/configured_gain.hpp"
#include "firmware/metrology/scan/contour_match.hpp"

namespace probebox::metrology {
namespace {

constexpr std::array<std::string_view, 10> kKeys{
    "centre_mm", "search_window_s", "gain_matrix",           "effective_radius_mm", "r1_mm",
    "r2_mm",     "arcs_rad",        "centre_is_approximate", "previous_tau_s",      "probe_kind"};

}  // namespace

Outcome<Result, Refusal> solveDelaySteppedScan(const Dataset& dataset) {
  const auto centre = requiredVector(dataset, "centre_mm");
  if (!centre) return centre.error();
  const auto window = searchWindow(dataset);
  if (!window) return window.error();
  const auto gain = configGain(dataset);
  if (!gain) return gain.error();
  const FeatureDistance sphere{.centre = Eigen::Vector3d{centre->data()}};
  return matchScans(dataset, {sphere, gain.value(), window.value(), "radius", true}, kKeys);
}

}  // namespace probebox::metrology
