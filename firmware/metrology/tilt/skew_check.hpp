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

// Checks the skew of a fit in the plane, its last two parameters, against the coordinates along the axis, which that
// fit does not use. For a point that turns about the axis u = (skew, 1), u . p is the same at every tilt; a bad one of
// two readings at different places along the axis looks like a skew, but changes u . p. A change beyond 5 sd gives a
// warning; if it also exceeds 0.1 mm (without sigma_mm: that alone), it refuses: readings-contradict.
// A lean beyond 2 mrad (and its noise) gives a warning, one beyond 0.1 rad is refused: implausible.
Outcome<std::optional<std::string>, Refusal> checkSkew(const std::vector<TiltReading>& readings, const Fit& fit,
                                                       const Sigma& sigma);

}  // namespace probebox::metrology
