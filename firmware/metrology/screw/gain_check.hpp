#pragma once
#include <string>
#include <vector>

#include "firmware/metrology/dataset/dataset.hpp"
#include "firmware/metrology/fit/least_squares.hpp"
#include "firmware/metrology/live/screw_model.hpp"

namespace probebox::metrology {

// Doubts about a gain K (D2) by the checked table gain_cal{x_mm,ext_um,error_um}: beyond 0.3 to 3, which no screw has,
// and true errors that K does not explain (at 0.1 %), as a term of their own, one in x and one in the extension do. A
// warning each.
std::vector<std::string> gainDoubts(const Table& table, const ScrewModel& screw, const Fit& gain);

}  // namespace probebox::metrology
