#include "tools/link/host_ledger.hpp"

#include <algorithm>

namespace probebox::link {
namespace {
std::uint64_t distance(SampleIndex from, SampleIndex to) {
  return static_cast<std::uint64_t>(to - from);
}
}  // namespace

void HostLedger::frame(std::uint32_t sequence) {
  if (!next_sequence_) {
    frame_lost_since_ = true;  // whatever came before was not seen
  } else if (const std::uint32_t missing = sequence - *next_sequence_; missing != 0) {
    // A step back is another sender, not four thousand million lost frames.
    if (missing < 0x8000'0000U) frames_missing_ += missing;
    frame_lost_since_ = true;
  }
  next_sequence_ = sequence + 1;
}

messages::Gap HostLedger::samples(SampleIndex first, std::uint64_t count, bool readable) {
  const auto hole = reach(first);
  if (first < expected_) {
    repeated_ += count;
    return hole;
  }
  (readable ? account_.received : account_.unreadable) += count;
  expected_ = first + static_cast<std::int64_t>(count);
  return hole;
}

messages::Gap HostLedger::gap(const messages::Gap& gap) {
  const auto hole = reach(gap.first);
  if (gap.first < expected_) {
    repeated_ += gap.count;
    return hole;
  }
  account_.declared_lost += gap.count;
  expected_ = gap.first + static_cast<std::int64_t>(gap.count);
  return hole;
}

messages::Gap HostLedger::heartbeat(const messages::Heartbeat& beat) {
  if (beat.stream_number == 0 || (closed_ && beat.stream_number == stream_)) return {};
  enter(beat);
  if (beat.produced == 0 && !begun_) {
    if (!beat.streaming) balance_ = Balance{{}, 0, true};  // stopped before its first sample
    closed_ = !beat.streaming;
    return {};
  }
  if (!begun_) {
    openStream(beat.start);
  } else if (beat.start < start_) {
    account_.inferred_lost += distance(beat.start, start_);
    start_ = beat.start;
  }
  const auto hole = reach(beat.position);
  balance_ = Balance{account_, beat.produced - before_, false};
  const bool all_came = account_.inferred_lost == 0 && before_ == 0;
  const bool agrees = account_.received + account_.unreadable == beat.sent_samples &&
                      account_.declared_lost == beat.lost_at_source + beat.lost_in_queue;
  balance_->exact = account_.total() == balance_->produced && (!all_came || agrees) && beat.position == expected_ &&
                    beat.sent_samples + beat.lost_at_source + beat.lost_in_queue == beat.produced;
  closed_ = !beat.streaming;
  return hole;
}

// A heartbeat of another START than before: its samples come after it, unless the wire lost the one that opened it.
void HostLedger::enter(const messages::Heartbeat& beat) {
  const bool first = stream_ == 0;
  if (beat.stream_number == stream_) return;
  stream_ = beat.stream_number;
  if (first) return;
  begun_ = closed_ = false;
  account_ = {};
  balance_.reset();
  before_ = 0;
  if (beat.produced > 0) {
    openStream(beat.start);
    expected_ = beat.position;
    before_ = beat.produced;
  }
}

void HostLedger::restart() {
  begun_ = closed_ = false;
  account_ = {};
  balance_.reset();
  before_ = 0;
  stream_ = 0;
  next_sequence_.reset();
  frame_lost_since_ = false;
}

void HostLedger::openStream(SampleIndex start) {
  account_ = {};
  balance_.reset();
  before_ = 0;
  start_ = expected_ = start;
  begun_ = true;
  closed_ = false;
}

messages::Gap HostLedger::reach(SampleIndex first) {
  if (!begun_ || closed_) openStream(first);
  messages::Gap hole{expected_, 0, messages::GapReason::queue_full};
  if (first > expected_) {
    hole.count = distance(expected_, first);
    account_.inferred_lost += hole.count;
    if (!frame_lost_since_) unexplained_ += hole.count;
    expected_ = first;
  } else if (first < expected_) {
    ++unexplained_;
  }
  frame_lost_since_ = false;
  return hole;
}

}  // namespace probebox::link
