#pragma once
#include <cmath>
#include <cstdint>

#include "drivers/world/random.hpp"
#include "protocol/units/time.hpp"

namespace probebox::world {

// Computes the sampling instants of a device: its own rate and phase, no drift against the monotonic clock.
class Sampling {
 public:
  Sampling(MonoTime start, double rate_hz, Random& random)
      : interval_ns_{1e9 / rate_hz}, first_{start + Nanoseconds{std::llround(random.uniform() * interval_ns_)}} {}

  MonoTime at(std::int64_t index) const {
    return first_ + Nanoseconds{std::llround(static_cast<double>(index) * interval_ns_)};
  }

 private:
  double interval_ns_;
  MonoTime first_;
};

}  // namespace probebox::world
