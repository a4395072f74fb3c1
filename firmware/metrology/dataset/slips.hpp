#pragma once
#include <string>
#include <vector>

#include "firmware/metrology/dataset/dataset.hpp"
#include "firmware/metrology/dataset/method.hpp"

namespace probebox::metrology {

// One sentence for everything in the readings of a case that looks like a slip of a person and that no fit can show:
// rows that are copies, which make every standard deviation too small, and angles that look like degrees.
std::vector<std::string> slipsIn(const Dataset& dataset, const Method& method);

}  // namespace probebox::metrology
