#pragma once
#include <atomic>
#include <memory>
#include <poll.h>
#include <string>
#include <thread>
#include <vector>

#include "drivers/io/event_source.hpp"
#include "firmware/app/threads/counters.hpp"
#include "firmware/app/threads/dropped_events.hpp"
#include "firmware/app/threads/event_queue.hpp"
#include "firmware/app/threads/source_table.hpp"
#include "firmware/app/threads/time_source.hpp"
#include "firmware/app/threads/wake_up.hpp"
#include "protocol/events/event.hpp"

namespace probebox::app {

// Polls the sources, pushes their events into the core's queue, and reports the time. SCHED_FIFO if permitted.
class CaptureThread {
 public:
  // Interval of TimeAdvanced.
  static constexpr Nanoseconds kTimeAdvances = std::chrono::milliseconds{10};

  // `table` gets one row per source.
  CaptureThread(std::vector<std::unique_ptr<io::EventSource>> sources, TimeSource& time, EventQueue& queue,
                WakeUp& core, Counters& counters, SourceTable& table);
  ~CaptureThread();
  CaptureThread(const CaptureThread&) = delete;
  CaptureThread& operator=(const CaptureThread&) = delete;

 private:
  void run();
  void waitForSources();
  void drain(io::EventSource& source, MonoTime now);
  void push(const Event& event, MonoTime now);
  void tellProblems();

  std::vector<std::unique_ptr<io::EventSource>> sources_;
  TimeSource& time_;
  EventQueue& queue_;
  WakeUp& core_;
  Counters& counters_;
  SourceTable& table_;
  struct Told {
    std::string problem;
    std::uint32_t faults{};
    std::uint64_t unusable{};
  };
  std::vector<Told> told_;  // per source, last reported to the table
  std::vector<pollfd> waiting_;
  DroppedEvents dropped_;  // by a full queue, and not yet reported to the core
  std::atomic<bool> stopping_{false};
  std::thread thread_;
};

}  // namespace probebox::app
