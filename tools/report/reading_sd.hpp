#pragma once
#include <optional>

#include "firmware/metrology/dataset/result.hpp"

namespace probebox::report {

// Returns the sd of one reading from which the sd of the values follows, in the unit of the residuals: the stated sigma
// (widened, if the fit did), or the scatter of the residuals. Nothing if the result does not hold it, or has several
// kinds of readings.
std::optional<double> readingSd(const metrology::Result& result);

}  // namespace probebox::report
