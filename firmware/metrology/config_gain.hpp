#pragma once
#include <Eigen/Core>

#include "firmware/metrology/dataset.hpp"
#include "firmware/metrology/result.hpp"
#include "protocol/units/outcome.hpp"

namespace probebox::metrology {

// Gain matrix A of the probe (A3) from the config key gain_matrix, three rows of three numbers; the identity without
// the key. Refuses: bad-config.
Outcome<Eigen::Matrix3d, Refusal> configGain(const Dataset& dataset);

}  // namespace probebox::metrology
