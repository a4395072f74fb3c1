#include "drivers/world/lateness.hpp"

#include <algorithm>
#include <cmath>

namespace probebox::world {

double latenessNs(const SyncConfig& config, Random& random, bool& outlier) {
  double late_us = config.bias_us;
  if (config.jitter == Jitter::gauss) {
    late_us += config.jitter_us * std::clamp(random.normal(), -kLargestDeviate, kLargestDeviate);
  } else if (config.jitter == Jitter::lognormal) {
    late_us += config.jitter_us * std::exp(config.jitter_shape * random.normal());
  }
  outlier = random.happens(config.outlier_probability);
  if (outlier) late_us += random.uniform() * config.outlier_us;
  return 1e3 * late_us;
}

}  // namespace probebox::world
