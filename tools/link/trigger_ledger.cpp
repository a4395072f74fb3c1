#include "tools/link/trigger_ledger.hpp"

namespace probebox::link {

messages::TriggerGap TriggerLedger::reach(std::uint32_t number) {
  if (next_ == 0) next_ = number;
  messages::TriggerGap hole{next_, 0, messages::GapReason::queue_full};
  if (number > next_) {
    hole.count = number - next_;
    account_.inferred_lost += hole.count;
    next_ = number;
  }
  return hole;
}

messages::TriggerGap TriggerLedger::trigger(std::uint32_t number) {
  const auto hole = reach(number);
  if (number < next_) {
    exact_ = false;  // twice
    return hole;
  }
  ++account_.received;
  next_ = number + 1;
  return hole;
}

messages::TriggerGap TriggerLedger::gap(const messages::TriggerGap& gap) {
  const auto hole = reach(gap.first);
  if (gap.first < next_) {
    exact_ = false;
    return hole;
  }
  account_.declared_lost += gap.count;
  next_ = gap.first + gap.count;
  return hole;
}

void TriggerLedger::restart() {
  const bool was_exact = exact_;
  *this = TriggerLedger{};
  exact_ = was_exact;
}

// The heartbeat that opens a stream comes before its first trigger, unless the wire lost it.
messages::TriggerGap TriggerLedger::heartbeat(const messages::Heartbeat& beat) {
  if (beat.first_trigger == 0) return {};
  if (beat.stream_number != stream_) {
    account_ = {};
    stream_ = beat.stream_number;
    before_ = next_ = beat.next_trigger;
  }
  const auto hole = reach(beat.next_trigger);
  const auto produced = std::uint64_t{beat.next_trigger} - beat.first_trigger;
  exact_ = exact_ && account_.total() == std::uint64_t{beat.next_trigger} - before_ && next_ == beat.next_trigger &&
           std::uint64_t{beat.sent_triggers} + beat.lost_triggers == produced;
  return hole;
}

}  // namespace probebox::link
