#pragma once
#include <cstdint>

namespace probebox::box {

// Counts the values missing from a 32-bit sequence that wraps. A step backwards means that the device restarted; no
// loss is counted.
class SequenceWatch {
 public:
  // Accepts any first value.
  SequenceWatch() = default;
  // Expects the value after `before` first.
  explicit SequenceWatch(std::uint32_t before) : last_{before}, seen_{true} {}

  // Tests whether `sequence` repeats the last value.
  bool standsAt(std::uint32_t sequence) const { return seen_ && sequence == last_; }

  std::uint32_t missingBefore(std::uint32_t sequence) {
    const std::uint32_t step = sequence - last_;
    const bool forward = seen_ && step != 0 && step < kHalf;
    last_ = sequence;
    seen_ = true;
    return forward ? step - 1 : 0;
  }

 private:
  static constexpr std::uint32_t kHalf = 1U << 31;
  std::uint32_t last_{};
  bool seen_{};
};

}  // namespace probebox::box
