#pragma once
#include <optional>

#include "firmware/metrology/dataset/result.hpp"

namespace probebox::metrology {

// Finds the worst-determined combination in the covariance of the promised values, in units of their own sd. nullopt
// for a single value, or when every correlation is below 0.9.
std::optional<WorstDetermined> worstDeterminedOf(const Covariance& covariance);

}  // namespace probebox::metrology
