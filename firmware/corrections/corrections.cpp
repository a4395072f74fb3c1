#include "firmware/corrections/corrections.hpp"

#include <chrono>

namespace probebox::corrections {

void Corrections::push(const DelayActivated& activated) {
  snapshot_.delay = DelayInForce{activated.result_id != 0, activated.result_id, activated.tau_s, activated.sd_s};
}

void Corrections::push(const Edge& edge) {
  if (edge.role != LineRole::inhibit) return;
  const std::uint32_t bit = 1U << (edge.line % 32U);
  inhibit_lines_ = edge.level == Level::active ? inhibit_lines_ | bit : inhibit_lines_ & ~bit;
  inhibit();
}

void Corrections::push(const CutInhibit& inhibit_now) {
  inhibit_said_ = inhibit_now.active;
  inhibit();
}

void Corrections::inhibit() {
  snapshot_.inhibited = inhibit_said_ || inhibit_lines_ != 0;
}

void Corrections::advance(MonoTime now, const TickMap& map, const Ledger& ledger) {
  if (!started_) {
    started_ = true;
    heartbeat_at_ = now;
    last_change_ = now;
  }
  // A beat whose period brought no record is skipped, not made up for later.
  while (now - heartbeat_at_ >= kHeartbeat) {
    heartbeat_at_ += kHeartbeat;
    if (record_since_heartbeat_) ++snapshot_.heartbeat;
    record_since_heartbeat_ = false;
  }
  snapshot_.at = now;
  snapshot_.age_ms =
      static_cast<std::uint64_t>(std::chrono::duration_cast<std::chrono::milliseconds>(now - last_change_).count());
  snapshot_.clock_state = map.state;
  snapshot_.clock_sigma_ns = map.sigma_ns;
  snapshot_.clock_locked = map.state == ClockState::locked;
  snapshot_.produced_samples = ledger.produced;
  snapshot_.lost_at_source_samples = ledger.lost_at_source;
  snapshot_.lost_in_queue_samples = ledger.lost_in_queue;
  snapshot_.loss_seen = ledger.lost_at_source != 0 || ledger.lost_in_queue != 0;
}

}  // namespace probebox::corrections
