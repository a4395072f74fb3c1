#pragma once
#include <ctime>

#include "protocol/units/time.hpp"

namespace probebox::app {

// The daemon's only access to a clock. With a scale other than 1 (emulated machine only) time runs faster or slower
// than the kernel's.
class TimeSource {
 public:
  explicit TimeSource(double scale = 1.0) : scale_{scale}, start_ns_{kernelNs()} {}

  MonoTime now() const {
    const auto elapsed_ns = static_cast<double>(kernelNs() - start_ns_);
    return monoTime(start_ns_ + static_cast<std::int64_t>(elapsed_ns * scale_));
  }
  // Kernel time to wait for `duration` of scaled time.
  Nanoseconds kernelDuration(Nanoseconds duration) const {
    return Nanoseconds{static_cast<std::int64_t>(static_cast<double>(duration.count()) / scale_)};
  }
  double scale() const { return scale_; }

 private:
  static std::int64_t kernelNs() {
    timespec time{};
    clock_gettime(CLOCK_MONOTONIC, &time);
    return std::int64_t{time.tv_sec} * 1'000'000'000 + time.tv_nsec;
  }

  double scale_;
  std::int64_t start_ns_;
};

}  // namespace probebox::app
