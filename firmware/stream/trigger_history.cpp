#include "firmware/stream/trigger_history.hpp"

#include <algorithm>

namespace probebox::stream {

using messages::GapReason;

void TriggerHistory::push(const messages::Trigger& trigger) {
  if (trigger.number < next_) return;
  reach(trigger.number);
  if (count_ == ring_.size()) {
    forgotten_ = entry(0).number + 1;
    first_ = (first_ + 1) % ring_.size();
    --count_;
  }
  ring_[(first_ + count_++) % ring_.size()] = trigger;
  next_ = trigger.number + 1;
}

void TriggerHistory::reach(std::uint32_t number) {
  if (begin_ == 0) begin_ = number;
  next_ = std::max(next_, number);
}

TriggerHistory::Place TriggerHistory::at(std::uint32_t number) const {
  if (number < forgotten_) return {nullptr, {number, forgotten_ - number, GapReason::ring_overrun}};
  std::size_t low = 0;
  for (std::size_t high = count_; low < high;) {
    const auto middle = (low + high) / 2;
    if (entry(middle).number < number) {
      low = middle + 1;
    } else {
      high = middle;
    }
  }
  const auto until = low < count_ ? entry(low).number : next_;
  if (low < count_ && until == number) return {&entry(low), {}};
  return {nullptr, {number, until - number, GapReason::queue_full}};
}

void TriggerFeed::start(std::uint32_t from) {
  const auto at = from == 0 ? history_.next() : std::min(from, history_.next());
  ledger_ = {.first = at, .next = at};
  running_ = true;
}

void TriggerFeed::clear() {
  ledger_ = {};
  running_ = false;
}

TriggerHistory::Place TriggerFeed::next() const {
  auto place = history_.at(ledger_.next == 0 ? history_.begin() : ledger_.next);
  const bool at_start = ledger_.next == ledger_.first;
  if (at_start && place.loss.reason == GapReason::ring_overrun) place.loss.reason = GapReason::resume_too_old;
  return place;
}

void TriggerFeed::take(const TriggerHistory::Place& place) {
  if (ledger_.first == 0) ledger_.first = ledger_.next = history_.begin();
  if (place.trigger != nullptr) {
    ++ledger_.sent;
    ++ledger_.next;
  } else {
    ledger_.lost += place.loss.count;
    ledger_.next += place.loss.count;
  }
}

}  // namespace probebox::stream
