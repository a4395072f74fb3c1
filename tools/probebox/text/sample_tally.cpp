#include "tools/probebox/text/sample_tally.hpp"

namespace probebox::command {

void SampleTally::block(SampleIndex first, std::uint64_t count) {
  now_.received += fresh(first, count);
}

void SampleTally::gap(const messages::Gap& gap) {
  (messages::isSourceLoss(gap.reason) ? now_.lost_at_source : now_.lost_in_queue) += fresh(gap.first, gap.count);
}

void SampleTally::hole(const messages::Gap& hole) {
  now_.lost_on_link += fresh(hole.first, hole.count);
}

void SampleTally::heartbeat(const messages::Heartbeat& beat, const std::optional<link::Balance>& balance) {
  if (!balance || beat.position == beat.start) return;  // a stream without a sample
  if (!begun_) begin(beat.start);
  if (beat.start < first_) {  // the very first frames were lost
    now_.lost_on_link += static_cast<std::uint64_t>(first_ - beat.start);
    first_ = beat.start;
  }
  now_.produced = produced_before_ + static_cast<std::uint64_t>(beat.position - first_);
  exact_ = exact_ && balance->exact && now_.unexplained == 0 && now_.accounted() == now_.produced;
  at_heartbeat_ = now_;
  has_beat_ = true;
  const auto own = sinceStart();
  exact_since_start_ = exact_since_start_ && balance->exact && own.unexplained == 0 && own.accounted() == own.produced;
}

SampleTally::Sums SampleTally::sinceStart() const {
  if (!has_beat_) return {};
  return {.produced = at_heartbeat_.produced - produced_before_,
          .received = at_heartbeat_.received - before_.received,
          .lost_at_source = at_heartbeat_.lost_at_source - before_.lost_at_source,
          .lost_in_queue = at_heartbeat_.lost_in_queue - before_.lost_in_queue,
          .lost_on_link = at_heartbeat_.lost_on_link - before_.lost_on_link,
          .unexplained = at_heartbeat_.unexplained - before_.unexplained};
}

void SampleTally::link(const messages::BootId& boot_id) {
  if (boot_id_ && *boot_id_ != boot_id) restarted();
  boot_id_ = boot_id;
  ++links_;
}

void SampleTally::restarted() {
  if (!begun_) return;
  produced_before_ = now_.accounted() + now_.unexplained;
  before_ = now_;
  has_beat_ = false;
  exact_since_start_ = true;
  begun_ = false;
  ++restarts_;
}

void SampleTally::begin(SampleIndex first) {
  first_ = next_ = first;
  begun_ = true;
}

// How many of these samples were not seen before.
std::uint64_t SampleTally::fresh(SampleIndex first, std::uint64_t count) {
  if (!begun_) begin(first);
  if (first > next_) {
    now_.unexplained += static_cast<std::uint64_t>(first - next_);
    next_ = first;
  }
  const SampleIndex end = first + static_cast<std::int64_t>(count);
  if (end <= next_) return 0;
  const auto added = static_cast<std::uint64_t>(end - next_);
  next_ = end;
  return added;
}

}  // namespace probebox::command
