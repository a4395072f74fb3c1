#include "firmware/metrology/dataset/configured_direction.hpp"

#include <array>
#include <cmath>
#include <string>

#include "firmware/metrology/dataset/configuration.hpp"
#include "protocol/units/tolerances.hpp"

namespace probebox::metrology {
namespace {

using Eigen::Vector3d;

Outcome<Vector3d, Refusal> ofLengthOne(const std::array<double, 3>& given, std::string_view key) {
  const Vector3d direction{given.data()};
  if (std::abs(direction.norm() - 1.0) > kUnitLength) {
    return Refusal{"bad-config", "config key '" + std::string{key} + "' must be a unit vector; its length is " +
                                     text(direction.norm())};
  }
  return Vector3d{direction.normalized()};
}

}  // namespace

Outcome<std::optional<Vector3d>, Refusal> configDirection(const Dataset& dataset, std::string_view key) {
  TRY(const auto given, configVector(dataset, key));
  if (!given) return std::optional<Vector3d>{};
  TRY(const auto direction, ofLengthOne(*given, key));
  return std::optional{direction};
}

Outcome<Vector3d, Refusal> requiredDirection(const Dataset& dataset, std::string_view key) {
  TRY(const auto given, requiredVector(dataset, key));
  return ofLengthOne(given, key);
}

}  // namespace probebox::metrology
