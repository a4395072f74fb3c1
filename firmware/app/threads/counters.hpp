#pragma once
#include <array>
#include <atomic>
#include <cstdint>

#include "firmware/app/threads/triple_buffer.hpp"
#include "protocol/events/event.hpp"
#include "protocol/messages/status.hpp"

namespace probebox::app {

// Progress of each stage of the chain, counted by the stage and compared by the watchdog.
struct Progress {
  std::atomic<std::uint64_t> capture{0};  // rounds over all sources
  std::atomic<std::uint64_t> core{0};     // events taken from the capture queue
  std::atomic<std::uint64_t> state{0};    // publications
  std::atomic<std::uint64_t> links{0};    // newer states that the links have seen
  std::atomic<std::uint64_t> worker{0};   // rounds
};

// A receiver on USB, while it is connected: from the capture thread to the links' thread.
struct ReceiverCounters {
  std::atomic<std::uint64_t> bad_packets{0};
  TripleBuffer<messages::FrontEndStatus> front_end;
  TripleBuffer<messages::ReceiverInputs> inputs;
};

// Counters of the threads, for status and heartbeats.
struct Counters {
  std::atomic<std::uint64_t> deadline_misses{0};      // the capture thread woke up too late
  std::atomic<std::uint32_t> queue_high_water{0};     // events, the fullest that the capture queue has been
  std::atomic<std::uint64_t> queue_lost_events{0};    // the capture queue was full
  std::atomic<std::uint64_t> journal_lost_events{0};  // the journal could not keep up
  std::atomic<std::uint32_t> links{0};                // connected hosts
  std::array<ReceiverCounters, kReceivers> receivers;
  Progress progress;
};

}  // namespace probebox::app
