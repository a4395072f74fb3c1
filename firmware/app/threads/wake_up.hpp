#pragma once
#include <chrono>

namespace probebox::app {

// Wakes one waiting thread through an eventfd. notify() neither blocks nor allocates.
class WakeUp {
 public:
  WakeUp();
  ~WakeUp();
  WakeUp(const WakeUp&) = delete;
  WakeUp& operator=(const WakeUp&) = delete;

  void notify();
  void wait(std::chrono::milliseconds at_most);
  // Clears all notifications: for owners that wait for descriptor() themselves.
  void clear();
  int descriptor() const { return descriptor_; }

 private:
  int descriptor_;
};

}  // namespace probebox::app
