#pragma once
#include "firmware/metrology/dataset/dataset.hpp"
#include "firmware/metrology/dataset/result.hpp"

namespace probebox::metrology {

// Adds what the method cannot tell from readings of its kind, whatever their number, and what these readings leave
// open: one sentence each, naming the combination. They are behind what the solver itself has said.
void addUnobservable(Result& result, const Dataset& dataset);

}  // namespace probebox::metrology
