#pragma once
#include "firmware/corrections/snapshot.hpp"

namespace probebox::corrections {

// Samples since start: every index that the latch has passed is either recorded or declared lost at its source.
struct Ledger {
  std::uint64_t produced{};
  std::uint64_t lost_at_source{};
  std::uint64_t lost_in_queue{};
};

// Results in force and events -> what the CNC reads. Starts with valid = 0; a source without its inputs is invalid,
// never zero.
class Corrections {
 public:
  // Heartbeat period, of the register map.
  static constexpr Nanoseconds kHeartbeat = std::chrono::milliseconds{100};

  void push(const DelayActivated& activated);
  void push(const Edge& edge);  // of inhibit lines
  void push(const CutInhibit& inhibit_now);
  // The chain source -> clock -> latch has delivered a record.
  void recordArrived() { record_since_heartbeat_ = true; }
  // Silence advances ages and heartbeats; the heartbeat stands still when the chain delivers nothing.
  void advance(MonoTime now, const TickMap& map, const Ledger& ledger);

  const Snapshot& snapshot() const { return snapshot_; }

 private:
  void inhibit();

  Snapshot snapshot_;
  std::uint32_t inhibit_lines_{};  // a bit per line that is active
  bool inhibit_said_{};            // by the controller
  MonoTime heartbeat_at_{};
  MonoTime last_change_{};
  bool started_{};
  bool record_since_heartbeat_{};
};

}  // namespace probebox::corrections
