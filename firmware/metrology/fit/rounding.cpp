#include "firmware/metrology/fit/rounding.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace probebox::metrology {

// The characteristic function of the noise damps the saw-tooth error. Rounding alone makes up to a quarter of a step
// squared of the variance, where the readings alternate between two steps: only what is above that is noise for
// certain.
double roundingSd(double sd_reading, double step) {
  const double noise_variance = std::max(0.0, sd_reading * sd_reading - step * step / 4);
  const double damped = std::exp(-2 * std::pow(std::numbers::pi / step, 2) * noise_variance);
  return step / std::sqrt(12.0) * damped;
}

}  // namespace probebox::metrology
