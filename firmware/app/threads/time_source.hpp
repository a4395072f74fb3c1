#pragma once
#include <algorithm>
#include <atomic>
#include <ctime>

#include "protocol/units/time.hpp"

namespace probebox::app {

// The daemon's only access to a clock: the kernel's monotonic clock. With a scale other than 1 (emulated machine only)
// time runs faster or slower, and only in advance().
class TimeSource {
 public:
  explicit TimeSource(double scale = 1.0) : scale_{scale}, advanced_at_ns_{kernelNs()}, scaled_ns_{advanced_at_ns_} {}

  MonoTime now() const { return monoTime(scale_ == 1.0 ? kernelNs() : scaled_ns_.load(std::memory_order_relaxed)); }

  // Lets scaled time go on, and returns it. For the one thread that leads the emulated machine. Limit the step, and do
  // not go on while `is_held`: on a busy computer the machine is slow, and nothing that it sends is lost.
  MonoTime advance(bool is_held) {
    const std::int64_t kernel_ns = kernelNs();
    const auto longest_ns = static_cast<std::int64_t>(kLongestStep_ns / std::min(scale_, 1.0));
    const std::int64_t step_ns = is_held ? 0 : std::min(kernel_ns - advanced_at_ns_, longest_ns);
    advanced_at_ns_ = kernel_ns;
    scaled_ns_ += static_cast<std::int64_t>(static_cast<double>(step_ns) * scale_);
    return now();
  }
  // Kernel time to wait for `duration` of scaled time.
  Nanoseconds kernelDuration(Nanoseconds duration) const {
    return Nanoseconds{static_cast<std::int64_t>(static_cast<double>(duration.count()) / scale_)};
  }

 private:
  static constexpr double kLongestStep_ns = 5e6;

  static std::int64_t kernelNs() {
    timespec time{};
    clock_gettime(CLOCK_MONOTONIC, &time);
    return std::int64_t{time.tv_sec} * 1'000'000'000 + time.tv_nsec;
  }

  double scale_;
  std::int64_t advanced_at_ns_;
  std::atomic<std::int64_t> scaled_ns_;
};

}  // namespace probebox::app
