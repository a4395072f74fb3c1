#include "firmware/metrology/dataset/machine_plane.hpp"

#include <cmath>

#include "firmware/metrology/dataset/configuration.hpp"

namespace probebox::metrology {

std::string SwivelPlane::name() const {
  constexpr std::string_view kLetters = "xyz";
  return {kLetters[static_cast<std::size_t>(low())], kLetters[static_cast<std::size_t>(high())]};
}

Outcome<SwivelPlane, Refusal> swivelPlane(const Dataset& dataset, std::string_view key) {
  TRY(const auto direction, configVector(dataset, key));
  if (!direction) {
    return Refusal{"missing-key",
                   "config.json has no key '" + std::string{key} + "': give the axis, as [0, 1, 0] for +Y"};
  }
  const auto& values = *direction;
  for (std::size_t k = 0; k < 3; ++k) {
    if (std::abs(values[k]) != 1.0 || values[(k + 1) % 3] != 0.0 || values[(k + 2) % 3] != 0.0) continue;
    const auto axis = static_cast<Eigen::Index>(k);
    return SwivelPlane{.axis = axis, .first = (axis + 1) % 3, .second = (axis + 2) % 3, .sense = values[k]};
  }
  return Refusal{"bad-axis", "config key '" + std::string{key} +
                                 "' must be 1 or -1 along one of X, Y, Z and 0 along the "
                                 "others"};
}

Outcome<SwivelPlane, Refusal> planeAcross(const Dataset& dataset, std::string_view key) {
  if (!dataset.config.contains(key)) return SwivelPlane{.axis = 2, .first = 0, .second = 1, .sense = 1.0};
  return swivelPlane(dataset, key);
}

}  // namespace probebox::metrology
