#pragma once
#include <cstddef>
#include <vector>

#include "firmware/metrology/dataset/result.hpp"
#include "firmware/metrology/touch/ball_centre.hpp"
#include "firmware/metrology/touch/switched_touch.hpp"
#include "protocol/units/outcome.hpp"

namespace probebox::metrology {

// Computes the centre of the touched ball for each reading from touches of a touch-trigger probe, whose pre-travel has
// been taken out, or cancels in the answer: a sphere with free radius (B.0). reading_of_touch: one per touch, from 0
// without gaps, or kAlone. switch_sd_mm: repeatability of the switch (k = 1). sd: from the noise of the positions and
// of the switch, or from the scatter of contacts against releases where that is larger (jitter of the stamps), widened
// when the touches scatter more. Refuses what fitSphere refuses, naming the reading.
Outcome<BallCentres, Refusal> switchedCentres(const std::vector<SwitchedTouch>& touches,
                                              const std::vector<std::size_t>& reading_of_touch, double switch_sd_mm);

}  // namespace probebox::metrology
