#pragma once
#include <cstdint>

namespace probebox::box {

// Follows a 32-bit counter that wraps, and says how many values were left out. A step back is a device that started
// anew: no loss is claimed.
class SequenceWatch {
 public:
  // The first value may be any.
  SequenceWatch() = default;
  // The first value is the one after `before`.
  explicit SequenceWatch(std::uint32_t before) : last_{before}, seen_{true} {}

  // This value is the last one again.
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
