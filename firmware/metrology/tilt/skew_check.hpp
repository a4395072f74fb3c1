#pragma once
#include <optional>
#include <string>
#include <vector>

#include "firmware/metrology/dataset/configuration.hpp"
#include "firmware/metrology/dataset/result.hpp"
#include "firmware/metrology/fit/least_squares.hpp"
#include "firmware/metrology/tilt/tilt_readings.hpp"
#include "protocol/units/outcome.hpp"

namespace probebox::metrology {

// Check the skew of a fit in the plane, its last two parameters, against the coordinates along the axis, which that fit
// does not use. Of a point that turns about the axis u = (skew, 1) the product u . p stays the same at every tilt; a
// bad reading of two that lie at different places along the axis looks like a skew, and does not keep it. Gives a
// warning, or nothing, where the change stays below 0.1 mm; warns beyond 5 sd. Refuses: readings-contradict.
Outcome<std::optional<std::string>, Refusal> checkSkew(const std::vector<TiltReading>& readings, const Fit& fit,
                                                       const Sigma& sigma);

}  // namespace probebox::metrology
