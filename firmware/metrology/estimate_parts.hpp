#pragma once
#include <cstddef>
#include <string>
#include <vector>

#include "firmware/metrology/result.hpp"

namespace probebox::metrology {

// Values of an estimate that have one unit: their indices, and a key that names the unit.
struct EstimatePart {
  std::string key;
  std::vector<std::size_t> at;
};

// The whole estimate; of "six_errors", whose rows hold three lengths and three angles, "translations_mm" and
// "rotations_rad".
std::vector<EstimatePart> partsOf(const Estimate& estimate);

}  // namespace probebox::metrology
