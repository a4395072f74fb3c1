#include "firmware/metrology/tool/turning_axis.hpp"

#include <string>
#include <string_view>

#include "firmware/metrology/dataset/configuration.hpp"

namespace probebox::metrology {

using Eigen::Vector2d;

Outcome<std::optional<TurningAxis>, Refusal> turningAxis(const Dataset& dataset) {
  TRY(const auto at, configPlane(dataset, "centreline_mm"));
  TRY(const auto tilt, configPlane(dataset, "C_tilt_rad"));
  TRY(const auto z, configNumber(dataset, "centreline_z_mm"));
  TRY(const auto sd, configPositive(dataset, "sd_centreline_mm"));
  TRY(const auto tilt_sd, configPositive(dataset, "sd_C_tilt_rad"));
  for (const std::string_view key : {"C_tilt_rad", "sd_centreline_mm", "accepted_link_mm"}) {
    if (dataset.config.contains(key) && !at) {
      return Refusal{"missing-key", "config key '" + std::string{key} +
                                        "' is stated without centreline_mm: give x and y "
                                        "of the turning axis"};
    }
  }
  if (tilt.has_value() != z.has_value() || (tilt_sd && !tilt)) {
    return Refusal{"missing-key",
                   "C_tilt_rad and centreline_z_mm belong together: the tilt of the turning axis, and the Z at which "
                   "it is at centreline_mm"};
  }
  if (!at) return std::optional<TurningAxis>{};
  TurningAxis axis{.at = Vector2d{at->data()}};
  if (tilt) axis.tilt = Vector2d{tilt->data()};
  axis.z = z.value_or(0.0);
  axis.sd = sd.value_or(0.0);
  axis.tilt_sd = tilt_sd.value_or(0.0);
  return std::optional{axis};
}

}  // namespace probebox::metrology
