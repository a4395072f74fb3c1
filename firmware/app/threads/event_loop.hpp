#pragma once
#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>

struct sd_event;
struct sd_event_source;

namespace probebox::app {

// Waits for descriptors and for time to pass: sd-event, with callbacks as functions. One thread, except for quit's
// flag.
class EventLoop {
 public:
  EventLoop();
  ~EventLoop();
  EventLoop(const EventLoop&) = delete;
  EventLoop& operator=(const EventLoop&) = delete;

  // Watches a descriptor, which stays open for as long as the watch lives or until it is paused.
  class Watch {
   public:
    Watch() = default;
    // Also tells when the descriptor can be written to.
    void wantWrite(bool wanted);
    // For good, also from its own callback: the descriptor may be closed from then on.
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
  // From a callback.
  void quit();

 private:
  sd_event* loop_;
};

}  // namespace probebox::app
