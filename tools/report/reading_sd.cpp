#include "tools/report/reading_sd.hpp"

#include <algorithm>
#include <cmath>

namespace probebox::report {

// Each value's sd is its design figure times the sd of one reading.
std::optional<double> readingSd(const metrology::Result& result) {
  if (!result.design_per.ends_with(", " + result.residuals.unit)) return std::nullopt;
  double least = INFINITY;
  double greatest = 0.0;
  for (const auto& estimate : result.estimates) {
    for (std::size_t k = 0; k < std::min(estimate.sd.size(), estimate.design.size()); ++k) {
      if (!(estimate.design[k] > 0.0) || !(estimate.sd[k] > 0.0)) continue;
      const double sd = estimate.sd[k] / estimate.design[k];
      least = std::min(least, sd);
      greatest = std::max(greatest, sd);
    }
  }
  if (!(greatest > 0.0) || greatest > 1.05 * least) return std::nullopt;
  return greatest;
}

}  // namespace probebox::report
