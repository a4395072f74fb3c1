#include "firmware/metrology/fit/neighbour_correlation.hpp"

namespace probebox::metrology {

NeighbourCorrelation neighbourCorrelation(double found, double beyond, const std::function<double(double)>& expected) {
  constexpr double kCountsFrom = 2.0;       // deviations
  constexpr double kClearFrom = 3.0;        // deviations
  constexpr double kMostCorrelated = 0.95;  // beyond, a line follows the noise
  if (!(beyond > kCountsFrom)) return {};
  double low = 0.0, high = kMostCorrelated;
  while (high - low > 1e-3) {
    const double r = (low + high) / 2.0;
    (expected(r) < found ? low : high) = r;
  }
  return {.r = high, .is_clear = beyond > kClearFrom};
}

}  // namespace probebox::metrology
