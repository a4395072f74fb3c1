#pragma once
#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>

struct sd_event;
struct sd_event_source;

namespace probebox::app {

// Waits for descriptors and timers (sd-event) and calls functions. One thread, except for quit's flag.
class EventLoop {
 public:
  EventLoop();
  ~EventLoop();
  EventLoop(const EventLoop&) = delete;
  EventLoop& operator=(const EventLoop&) = delete;

  // Watches a descriptor, which must stay open until the watch is destroyed or paused.
  class Watch {
   public:
    Watch() = default;
    // Also reports when the descriptor is writable.
    void wantWrite(bool wanted);
    // Stops for good, also from its own callback: the descriptor may be closed afterwards.
    void pause();

   private:
    friend class EventLoop;
    struct Entry;
    struct Release {
      void operator()(Entry* entry) const;
    };
    std::unique_ptr<Entry, Release> entry_;
  };

  Watch watch(int descriptor, std::function<void()> ready);
  Watch every(std::chrono::milliseconds period, std::function<void()> due);

  void run();
  // Call from a callback.
  void quit();

 private:
  sd_event* loop_;
};

}  // namespace probebox::app
