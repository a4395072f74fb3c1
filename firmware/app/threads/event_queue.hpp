#pragma once
#include <atomic>
#include <cstddef>
#include <memory>

#include "protocol/events/event.hpp"

namespace probebox::app {

// Bounded queue of events from one thread to one other, without locks or allocation after construction. An event takes
// its own size and not that of the largest: an edge 24 bytes, a sample 40, the start of a run 288.
class EventQueue {
 public:
  explicit EventQueue(std::size_t at_least_bytes);

  // Returns false when full: the caller counts the loss.
  bool push(const Event& event);

  // Replaces `event` by the oldest one. Returns false when there is none.
  bool pop(Event& event);

  // For the pushing thread.
  bool isHalfFull() const {
    return tail_.load(std::memory_order_relaxed) - head_.load(std::memory_order_acquire) > capacity_ / 2;
  }
  // Momentary number of events, for high-water marks.
  std::size_t size() const;

 private:
  static constexpr std::size_t kCacheLine = 64;

  std::byte* at(std::size_t position) const { return bytes_.get() + (position & (capacity_ - 1)); }
  void write(std::size_t position, const void* from, std::size_t count);
  void read(std::size_t position, void* into, std::size_t count) const;
  template <std::size_t Alternative>
  std::size_t popAs(std::size_t position, Event& event) const;

  const std::size_t capacity_;
  const std::unique_ptr<std::byte[]> bytes_;
  // Positions count all bytes ever written or read. Each side knows an old one of the other.
  alignas(kCacheLine) std::atomic<std::size_t> head_{0};
  std::size_t tail_seen_{0};
  std::atomic<std::size_t> popped_{0};
  alignas(kCacheLine) std::atomic<std::size_t> tail_{0};
  std::size_t head_seen_{0};
  std::atomic<std::size_t> pushed_{0};
};

}  // namespace probebox::app
