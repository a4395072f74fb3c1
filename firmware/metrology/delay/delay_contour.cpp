#include "firmware/metrology/delay/delay_contour.hpp"

#include <array>

#include "firmware/metrology/dataset/configuration.hpp"
#include "firmware/metrology/dataset/configured_gain.hpp"
#include "firmware/metrology/scan/contour_match.hpp"

namespace probebox::metrology {
namespace {

constexpr std::array<std::string_view, 9> kKeys{"shape",        "centre_mm",      "axis_direction",
                                                "size_axis_mm", "feature",        "search_window_s",
                                                "gain_matrix",  "previous_tau_s", "probe_kind"};

}  // namespace

Outcome<Result, Refusal> solveDelayContour(const Dataset& dataset) {
  const auto feature = featureDistance(dataset);
  if (!feature) return feature.error();
  const auto window = searchWindow(dataset);
  if (!window) return window.error();
  const auto gain = configGain(dataset);
  if (!gain) return gain.error();
  return matchScans(dataset, {feature.value(), gain.value(), window.value()}, kKeys);
}

}  // namespace probebox::metrology
