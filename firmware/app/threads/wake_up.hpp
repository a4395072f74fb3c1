#pragma once
#include <chrono>

namespace probebox::app {

// Wakes one waiting thread from others, by an eventfd. notify() neither blocks nor allocates.
class WakeUp {
 public:
  WakeUp();
  ~WakeUp();
  WakeUp(const WakeUp&) = delete;
  WakeUp& operator=(const WakeUp&) = delete;

  void notify();
  // Waits for a notification, the end of `at_most`, or until descriptor `also` is readable (-1: none).
  void wait(std::chrono::milliseconds at_most, int also = -1);
  // Clears all notifications so far, for owners that wait for descriptor() by other means.
  void clear();
  int descriptor() const { return descriptor_; }

 private:
  int descriptor_;
};

}  // namespace probebox::app
