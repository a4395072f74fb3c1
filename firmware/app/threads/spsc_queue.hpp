#pragma once
#include <atomic>
#include <bit>
#include <cstddef>
#include <memory>
#include <type_traits>

namespace probebox::app {

// Bounded queue from one thread to one other, without locks or allocation after construction. Values are copied.
template <class T>
requires std::is_trivially_copyable_v<T>
class SpscQueue {
 public:
  explicit SpscQueue(std::size_t at_least)
      : capacity_{std::bit_ceil(at_least)}, slots_{std::make_unique<T[]>(capacity_)} {}

  // Returns false when full: the caller counts the loss.
  bool push(const T& value) {
    const std::size_t tail = tail_.load(std::memory_order_relaxed);
    if (tail - head_seen_ == capacity_) {
      head_seen_ = head_.load(std::memory_order_acquire);
      if (tail - head_seen_ == capacity_) return false;
    }
    slots_[tail & (capacity_ - 1)] = value;
    tail_.store(tail + 1, std::memory_order_release);
    return true;
  }

  bool pop(T& value) {
    const std::size_t head = head_.load(std::memory_order_relaxed);
    if (head == tail_seen_) {
      tail_seen_ = tail_.load(std::memory_order_acquire);
      if (head == tail_seen_) return false;
    }
    value = slots_[head & (capacity_ - 1)];
    head_.store(head + 1, std::memory_order_release);
    return true;
  }

  // Momentary size, for high-water marks.
  std::size_t size() const { return tail_.load(std::memory_order_relaxed) - head_.load(std::memory_order_relaxed); }
  std::size_t capacity() const { return capacity_; }

 private:
  static constexpr std::size_t kCacheLine = 64;

  const std::size_t capacity_;
  const std::unique_ptr<T[]> slots_;
  alignas(kCacheLine) std::atomic<std::size_t> head_{0};
  std::size_t tail_seen_{0};  // consumer's copy
  alignas(kCacheLine) std::atomic<std::size_t> tail_{0};
  std::size_t head_seen_{0};  // producer's copy
};

}  // namespace probebox::app
