#include "firmware/metrology/dataset/configured_direction.hpp"

#include <array>
#include <cmath>
#include <string>

#include "firmware/metrology/dataset/configuration.hpp"

namespace probebox::metrology {
namespace {

using Eigen::Vector3d;

constexpr double kUnit = 1e-3;  // how far from 1 the length may be: people write three digits

Outcome<Vector3d, Refusal> ofLengthOne(const std::array<double, 3>& given, std::string_view key) {
  const Vector3d direction{given.data()};
  if (std::abs(direction.norm() - 1.0) > kUnit) {
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
