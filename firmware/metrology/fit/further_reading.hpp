#pragma once
#include <cmath>
#include <optional>

#include "firmware/metrology/fit/chi_square.hpp"
#include "firmware/metrology/fit/fit_report.hpp"

namespace probebox::metrology {

// Answer::readingSd as the sd of a further reading, or of what the fit leaves: without a stated sigma by Student's t
// (chi_square.hpp), so nothing up to two degrees of freedom.
inline std::optional<double> sdOfFurtherReading(const Answer& answer, const Fit& fit, const Sigma& sigma) {
  if (sigma.stated) return answer.readingSd();
  const auto variance = varianceFromResiduals(fit.sumOfSquares(), fit.dof);
  return variance ? std::optional{std::sqrt(*variance) * sigma.value} : std::nullopt;
}

}  // namespace probebox::metrology
