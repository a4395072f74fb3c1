#pragma once
#include <array>
#include <atomic>
#include <cstdint>
#include <deque>
#include <functional>
#include <mutex>
#include <thread>

#include "firmware/app/threads/wake_up.hpp"

namespace probebox::app {

// Runs everything that may take time in one thread: solving, SQLite, files. Jobs of one rank run in the order of
// posting, those of a lower rank when none of a higher one waits.
class Worker {
 public:
  enum class Rank : std::uint8_t {
    usual,
    patient,         // takes seconds
    without_rights,  // of a host that has none, which may not keep others waiting
  };

  // `on_wake` runs in the worker's thread after every notify(), after every job, and periodically.
  explicit Worker(std::function<void()> on_wake);
  ~Worker() { stop(); }
  Worker(const Worker&) = delete;
  Worker& operator=(const Worker&) = delete;

  // Returns false when too many jobs of this rank wait: the caller reports that the box is busy.
  bool post(std::function<void()> job, Rank rank = Rank::usual);
  // Runs the posted jobs, then ends the thread; notify() stays allowed.
  void stop();
  // Call within on_wake: the next round also begins when this descriptor is readable (-1: none).
  void alsoWaitFor(int descriptor) { also_ = descriptor; }
  // Neither blocks nor allocates: for the tick path.
  void notify() { wake_up_.notify(); }

 private:
  using Jobs = std::deque<std::function<void()>>;
  void run();
  std::function<void()> take();

  std::function<void()> on_wake_;
  WakeUp wake_up_;
  std::mutex mutex_;
  std::array<Jobs, 3> jobs_;  // by rank
  int also_{-1};
  std::atomic<bool> stopping_{false};
  std::thread thread_;
};

}  // namespace probebox::app
