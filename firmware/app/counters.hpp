#pragma once
#include <atomic>
#include <cstdint>

namespace probebox::app {

// What the threads count about themselves, for status and heartbeats.
struct Counters {
  std::atomic<std::uint64_t> deadline_misses{0};      // the capture thread woke up too late
  std::atomic<std::uint32_t> queue_high_water{0};     // events, the fullest that the capture queue has been
  std::atomic<std::uint64_t> queue_lost_events{0};    // the capture queue was full
  std::atomic<std::uint64_t> journal_lost_events{0};  // the journal could not keep up
  std::atomic<std::uint32_t> links{0};                // connected hosts
};

}  // namespace probebox::app
