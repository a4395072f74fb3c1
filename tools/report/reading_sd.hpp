#pragma once
#include <optional>

#include "firmware/metrology/dataset/result.hpp"

namespace probebox::report {

// sd of one reading, in the unit of the residuals, that the sd of the values rests on: the stated sigma, widened where
// it was, or that of the residuals. Nothing where the result does not say it, or holds readings of several kinds.
std::optional<double> readingSd(const metrology::Result& result);

}  // namespace probebox::report
