#pragma once
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
    return queue_.push(command);
  }
  bool pop(Event& command) { return queue_.pop(command); }

 private:
  std::mutex commanders_;
  // At its start the core receives all results in force, one event per row of a table by angle.
  EventQueue queue_{128 * 1024};
};

}  // namespace probebox::app
