#pragma once
#include "firmware/metrology/dataset/dataset.hpp"
#include "firmware/metrology/dataset/result.hpp"

namespace probebox::casefolder {

// As metrology::solve(), with all the memory of this computer. Refuses too-much-memory where that is not enough.
metrology::Solved solveHere(const metrology::Dataset& dataset);

}  // namespace probebox::casefolder
