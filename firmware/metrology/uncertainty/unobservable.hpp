#pragma once
#include "firmware/metrology/dataset/dataset.hpp"
#include "firmware/metrology/dataset/result.hpp"

namespace probebox::metrology {

// Adds one sentence for each quantity or combination that such readings cannot determine, whatever their number, or
// that these readings do not determine, after those of the solver.
void addUnobservable(Result& result, const Dataset& dataset);

}  // namespace probebox::metrology
