#pragma once
#include <optional>
#include <string>

#include "firmware/metrology/dataset/dataset.hpp"

namespace probebox::metrology {

// Names what cannot be determined from table `readings` because spindle (A_rad) or C (C_rad) stood still, or both
// turned by the same angles; nothing where both turned independently.
std::optional<std::string> undeterminedByAngles(const Dataset& dataset);

// Whether the spindle (A_rad) has one angle in all rows of table `readings`.
bool spindleStoodStill(const Dataset& dataset);

}  // namespace probebox::metrology
