#pragma once
#include <array>
#include <atomic>
#include <cstdint>

namespace probebox::app {

// Passes the newest value of one writer to one reader without waiting. The reader gets complete values only.
template <class T>
class TripleBuffer {
 public:
  void publish(const T& value) {
    slots_[write_].value = value;
    write_ = shared_.exchange(static_cast<std::uint8_t>(write_ | kFresh), std::memory_order_acq_rel) & kSlot;
  }

  const T& newest() {
    if ((shared_.load(std::memory_order_relaxed) & kFresh) != 0)
      read_ = shared_.exchange(read_, std::memory_order_acq_rel) & kSlot;
    return slots_[read_].value;
  }

 private:
  static constexpr std::uint8_t kFresh = 4;
  static constexpr std::uint8_t kSlot = 3;
  struct alignas(64) Slot {
    T value{};
  };

  std::array<Slot, 3> slots_{};
  std::uint8_t write_{0};
  std::atomic<std::uint8_t> shared_{1};
  std::uint8_t read_{2};
};

}  // namespace probebox::app
