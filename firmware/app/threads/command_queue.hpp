#pragma once
#include <atomic>
#include <cstdint>
#include <mutex>

#include "firmware/app/threads/event_queue.hpp"
#include "protocol/events/event.hpp"

namespace probebox::app {

// Carries commands of many threads to the core. Only the senders share a lock; the core takes commands without one.
class CommandQueue {
 public:
  // Returns false when full: the caller reports that the box is busy.
  bool push(const Event& command) {
    const std::lock_guard lock{commanders_};
    if (!queue_.push(command)) return false;
    ++pushed_;
    return true;
  }
  // Number of commands that were pushed so far.
  std::uint64_t pushed() const { return pushed_; }
  // Number of commands whose effect every reader of the state can see.
  std::uint64_t published() const { return published_.load(std::memory_order_acquire); }

  // Called by the core: take a command; after it was applied; after a state was published.
  bool pop(Event& command) { return queue_.pop(command); }
  void setApplied() { ++applied_; }
  void setPublished() { published_.store(applied_, std::memory_order_release); }

 private:
  std::mutex commanders_;
  // At its start the core receives all results in force, one event per row of a table by angle.
  EventQueue queue_{128 * 1024};
  std::atomic<std::uint64_t> pushed_{0};
  std::uint64_t applied_{};
  std::atomic<std::uint64_t> published_{0};
};

}  // namespace probebox::app
