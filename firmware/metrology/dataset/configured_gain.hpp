#pragma once
#include <Eigen/Core>
#include <string_view>

#include "firmware/metrology/dataset/dataset.hpp"
#include "firmware/metrology/dataset/result.hpp"
#include "protocol/units/outcome.hpp"

namespace probebox::metrology {

// Reads the gain matrix A of the probe (A3), three rows of three numbers; identity when the key is absent. Refuses:
// bad-config.
Outcome<Eigen::Matrix3d, Refusal> configGain(const Dataset& dataset, std::string_view key = "gain_matrix");

}  // namespace probebox::metrology
