#pragma once
#include <mutex>

#include "firmware/app/threads/spsc_queue.hpp"
#include "protocol/events/event.hpp"

namespace probebox::app {

// Commands of many threads to the core. Only those who command ever wait for the lock; the core takes without one.
class CommandQueue {
 public:
  // False when full: the caller tells its client that the box is busy.
  bool push(const Event& command) {
    const std::lock_guard lock{commanders_};
    return queue_.push(command);
  }
  bool pop(Event& command) { return queue_.pop(command); }

 private:
  std::mutex commanders_;
  // At its start the core hears of all results in force, and a table by angle is an event a row.
  SpscQueue<Event> queue_{1024};
};

}  // namespace probebox::app
