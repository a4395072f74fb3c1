#include "drivers/world/lateness.hpp"

#include <algorithm>
#include <cmath>

namespace probebox::world {

namespace {
constexpr double kJitterShape = 0.5;  // standard deviation of the logarithm (lognormal)
}  // namespace

double latenessNs(const board::WorldClock& clock, Random& random, bool& outlier) {
  double late_us = clock.bias_us;
  if (clock.jitter == board::Jitter::gauss) {
    late_us += clock.jitter_us * std::clamp(random.normal(), -kLargestDeviate, kLargestDeviate);
  } else if (clock.jitter == board::Jitter::lognormal) {
    late_us += clock.jitter_us * std::exp(kJitterShape * random.normal());
  }
  outlier = random.happens(clock.outlier_probability);
  if (outlier) late_us += random.uniform() * clock.outlier_us;
  return 1e3 * late_us;
}

}  // namespace probebox::world
