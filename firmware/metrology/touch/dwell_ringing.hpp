#pragma once
#include <vector>

#include "firmware/metrology/touch/touch.hpp"

namespace probebox::metrology {

// Removes the stylus ringing since contact from the touches. During the rest at the apex the probe shows c + exp(-t/T)
// (a cos wt + b sin wt), with w and T common to all touches and amplitudes per touch. The ringing continues into the
// retract and would bias its line, so it is subtracted from the rest to the separation (docs/metrology.md A.3). Touches
// with too short a rest are returned unchanged, and all of them if the rests contain only noise.
std::vector<Touch> withoutRinging(std::vector<Touch> touches);

}  // namespace probebox::metrology
