#pragma once
#include <optional>

#include "firmware/metrology/dataset/result.hpp"

namespace probebox::metrology {

// From the covariance of the promised values, in units of their own sd: its worst direction. Nothing where the readings
// tell all values apart (every correlation below 0.9), or where there is only one.
std::optional<Weakest> weakestOf(const Covariance& covariance);

}  // namespace probebox::metrology
