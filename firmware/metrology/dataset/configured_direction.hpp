#pragma once
#include <Eigen/Core>
#include <optional>
#include <string_view>

#include "firmware/metrology/dataset/dataset.hpp"
#include "firmware/metrology/dataset/result.hpp"
#include "protocol/units/outcome.hpp"

namespace probebox::metrology {

// Reads a unit vector from a config key; nullopt when the key is absent. Refuses: bad-config.
Outcome<std::optional<Eigen::Vector3d>, Refusal> configDirection(const Dataset& dataset, std::string_view key);

// Reads a unit vector that the method requires. Refuses: missing-key, bad-config.
Outcome<Eigen::Vector3d, Refusal> requiredDirection(const Dataset& dataset, std::string_view key);

}  // namespace probebox::metrology
