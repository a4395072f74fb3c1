#include "firmware/stream/sample_feed.hpp"

#include <algorithm>

namespace probebox::stream {
namespace {
std::uint64_t distance(SampleIndex from, SampleIndex to) {
  return static_cast<std::uint64_t>(to - from);
}
}  // namespace

SampleFeed::SampleFeed(Limits limits, const History& history)
    : history_{history}, queue_{limits.queue_bytes, limits.queue_pieces}, limits_{limits} {}

void SampleFeed::start(messages::Policy policy, messages::Profile profile) {
  begin(policy, profile, history_.begun(profile) ? std::optional{history_.next(profile)} : std::nullopt);
}

bool SampleFeed::resume(messages::Policy policy, SampleIndex from, messages::Profile profile) {
  if (!history_.begun(profile)) {
    begin(policy, profile, std::nullopt);
    return true;
  }
  if (from > history_.next(profile) || from < SampleIndex{}) return false;
  const auto piece = history_.find(profile, from);
  begin(policy, profile, piece && piece->isBlock() ? piece->first : from);
  catching_up_ = true;
  return true;
}

void SampleFeed::begin(messages::Policy policy, messages::Profile profile, std::optional<SampleIndex> at) {
  policy_ = policy;
  profile_ = next_profile_ = profile;
  queue_.clear();
  running_ = true;
  catching_up_ = false;
  begun_ = at.has_value();
  expected_ = at.value_or(SampleIndex{});
  ledger_ = {.start = expected_, .position = expected_};
}

void SampleFeed::follow(messages::Profile profile) {
  next_profile_ = profile;
  if (!catching_up_) profile_ = profile;
}

void SampleFeed::stop() {
  running_ = catching_up_ = false;
  queue_.clear();
}

// Brings the queue up to `first`; false when there is nothing to do with it. While catching up the history has it
// already.
bool SampleFeed::reach(SampleIndex first) {
  if (!running_ || catching_up_) return false;
  if (!begun_) {
    begun_ = true;
    expected_ = ledger_.start = ledger_.position = first;
  }
  if (first > expected_) {
    queue_.pushGap({expected_, distance(expected_, first), GapReason::source_clock});
    expected_ = first;
  }
  return true;
}

void SampleFeed::offer(const EncodedBlock& block) {
  if (block.profile != profile_ || !reach(block.first)) return;
  if (block.first < expected_) {
    ++repeated_;
    return;
  }
  enqueue(block);
  expected_ = block.first + block.count;
  high_water_ = std::max(high_water_, queue_.bytes());
}

void SampleFeed::offer(const GapNotice& gap) {
  if (!reach(gap.first)) return;
  const auto end = gap.first + static_cast<std::int64_t>(gap.count);
  if (end <= expected_) {
    ++repeated_;
    return;
  }
  queue_.pushGap({expected_, distance(expected_, end), gap.reason});
  expected_ = end;
}

void SampleFeed::enqueue(const EncodedBlock& block) {
  const bool live = policy_ == messages::Policy::live;
  const auto size = block.bytes.size();
  const auto descriptor = history_.descriptors().current();
  const auto limit = std::min(live ? limits_.live_bytes : limits_.queue_bytes, limits_.queue_bytes);
  bool kept = false;
  if (size > 0 && size <= std::min(limit, limits_.max_block)) {
    while (live && queue_.bytes() + size > limit && queue_.giveUpOldest(GapReason::queue_full)) {
    }
    kept = queue_.pushBlock(block, descriptor);
    while (live && !kept && queue_.giveUpOldest(GapReason::queue_full)) kept = queue_.pushBlock(block, descriptor);
  }
  if (!kept) queue_.pushGap({block.first, block.count, GapReason::queue_full});
}

std::optional<Piece> SampleFeed::next() {
  if (!running_) return std::nullopt;
  if (!queue_.empty()) return queue_.front();
  return catching_up_ ? nextOfHistory() : std::nullopt;
}

std::optional<Piece> SampleFeed::nextOfHistory() {
  const auto position = ledger_.position;
  if (position >= history_.next(profile_)) {
    catching_up_ = false;
    profile_ = next_profile_;
    expected_ = position;
    return std::nullopt;
  }
  if (position < history_.oldest(profile_)) {
    const bool at_start = position == ledger_.start;
    return Piece{position,
                 distance(position, history_.oldest(profile_)),
                 at_start ? GapReason::resume_too_old : GapReason::ring_overrun,
                 {}};
  }
  auto piece = history_.find(profile_, position);
  if (piece && piece->first < position) {
    // A loss that has grown since its first part was sent; a block is never entered in the middle.
    piece->count = distance(position, piece->end());
    piece->first = position;
  }
  if (piece && piece->bytes.size() > limits_.max_block)
    return Piece{piece->first, piece->count, GapReason::queue_full, {}};
  return piece;
}

void SampleFeed::take(const Piece& piece) {
  if (piece.isBlock()) {
    ledger_.sent += piece.count;
  } else if (messages::isSourceLoss(piece.reason)) {
    ledger_.lost_at_source += piece.count;
  } else {
    ledger_.lost_in_queue += piece.count;
  }
  ledger_.position = piece.end();
  if (!queue_.empty()) queue_.popFront();
}

std::uint64_t SampleFeed::queuedSamples() const {
  if (!running_ || !begun_) return 0;
  return catching_up_ ? distance(ledger_.position, std::max(history_.next(profile_), ledger_.position))
                      : queue_.samples();
}

}  // namespace probebox::stream
