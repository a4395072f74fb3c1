#include "firmware/latch/interpolation.hpp"

#include <cmath>

namespace probebox::latch {
namespace {

double since(MonoTime earlier, MonoTime later) {
  return static_cast<double>((later - earlier).count());
}

// Counters may wrap around: so does their difference.
double difference(std::int64_t a, std::int64_t b) {
  return static_cast<double>(static_cast<std::int64_t>(static_cast<std::uint64_t>(a) - static_cast<std::uint64_t>(b)));
}

std::int64_t plus(std::int64_t value, double step) {
  return static_cast<std::int64_t>(static_cast<std::uint64_t>(value) + static_cast<std::uint64_t>(std::llround(step)));
}

}  // namespace

std::int64_t linear(MonoTime t, const std::array<MonoTime, 2>& at, const std::array<std::int64_t, 2>& values) {
  return plus(values[0], difference(values[1], values[0]) * since(at[0], t) / since(at[0], at[1]));
}

std::int64_t cubic(MonoTime t, const std::array<MonoTime, 4>& at, const std::array<std::int64_t, 4>& values) {
  double step = 0;
  for (std::size_t i = 0; i < 4; ++i) {
    double weight = 1;
    for (std::size_t j = 0; j < 4; ++j) {
      if (j != i) weight *= since(at[j], t) / since(at[j], at[i]);
    }
    step += weight * difference(values[i], values[1]);
  }
  return plus(values[1], step);
}

}  // namespace probebox::latch
