#pragma once
#include <string>
#include <vector>

#include "firmware/metrology/dataset/dataset.hpp"
#include "firmware/metrology/dataset/method.hpp"

namespace probebox::metrology {

// One sentence for everything in the readings of a case that looks like a slip of a person and that no fit can show:
// rows that are copies, which make every standard deviation too small, and columns that look as if they had another
// unit than their name says: degrees for radians, millimetres for micrometres, milliseconds for seconds.
std::vector<std::string> slipsIn(const Dataset& dataset, const Method& method);

}  // namespace probebox::metrology
