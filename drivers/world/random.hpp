#pragma once
#include <cmath>
#include <cstdint>

#include "protocol/units/time.hpp"

namespace probebox::world {

// Who draws in the emulated machine. A number stays with its owner: the same seed gives the same world.
enum RandomStream : std::uint64_t {
  encoders = 1,
  probe = 2,
  sync_line = 3,
  screws = 7,
  machine = 11,
  setter = 13,
  touch_trigger = 17
};

// Draws random numbers that are equal on every machine and with every standard library: SplitMix64 (Steele, Lea, Flood
// 2014), normal deviates by the polar method (Marsaglia, Bray 1964).
class Random {
 public:
  // Streams of one seed are independent: draws from one stream do not change another.
  Random(std::uint64_t seed, std::uint64_t stream) : state_{seed} {
    state_ = next() ^ (stream * 0xd1342543de82ef95ULL);
    next();
  }

  std::uint64_t next() {
    state_ += 0x9e3779b97f4a7c15ULL;
    std::uint64_t z = state_;
    z = (z ^ (z >> 30U)) * 0xbf58476d1ce4e5b9ULL;
    z = (z ^ (z >> 27U)) * 0x94d049bb133111ebULL;
    return z ^ (z >> 31U);
  }

  double uniform() { return static_cast<double>(next() >> 11U) * 0x1p-53; }  // [0, 1)
  double uniform(double low, double high) { return low + (high - low) * uniform(); }
  bool happens(double probability) { return probability > 0 && uniform() < probability; }

  double normal() {
    if (has_spare_) return has_spare_ = false, spare_;
    double a{}, b{}, square{};
    do {
      a = 2 * uniform() - 1;
      b = 2 * uniform() - 1;
      square = a * a + b * b;
    } while (square >= 1 || square == 0);
    const double scale = std::sqrt(-2 * std::log(square) / square);
    spare_ = b * scale;
    has_spare_ = true;
    return a * scale;
  }

 private:
  std::uint64_t state_;
  double spare_{};
  bool has_spare_{};
};

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
