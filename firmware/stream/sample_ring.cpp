#include "firmware/stream/sample_ring.hpp"

#include <algorithm>

namespace probebox::stream {
namespace {

// Two losses of different reasons share one piece only when pieces run out; what the queue did then outweighs.
GapReason joined(GapReason a, GapReason b) {
  if (a == b || (messages::isSourceLoss(a) && messages::isSourceLoss(b))) return a;
  return GapReason::queue_full;
}

}  // namespace

// One piece is kept for a loss after the last block, so that pushGap() cannot fail.
SampleRing::SampleRing(std::size_t bytes, std::size_t pieces)
    : blocks_{bytes, std::max<std::size_t>(pieces, 2)}, entries_(std::max<std::size_t>(pieces, 2)) {}

bool SampleRing::pushBlock(const EncodedBlock& block, std::uint32_t descriptor) {
  if (count_ + 1 >= entries_.size() || !blocks_.push(block.bytes)) return false;
  append({block.first, block.count, GapReason{}, true, descriptor, oldest_serial_ + blocks_.items() - 1});
  return true;
}

void SampleRing::pushGap(const GapNotice& gap) {
  if (gap.count == 0) return;
  if (count_ > 0) {
    auto& last = entry(count_ - 1);
    if (!last.is_block && (last.reason == gap.reason || count_ == entries_.size())) {
      last.reason = joined(last.reason, gap.reason);
      last.count += gap.count;
      samples_ += gap.count;
      next_ = gap.first + static_cast<std::int64_t>(gap.count);
      return;
    }
  }
  append({gap.first, gap.count, gap.reason, false, 0, 0});
}

bool SampleRing::giveUpOldest(GapReason reason) {
  std::size_t k = 0;
  while (k < count_ && !entry(k).is_block) ++k;
  if (k == count_) {
    if (count_ < 2) return false;
    joinWithNext(0);
    return true;
  }
  entry(k).is_block = false;
  entry(k).reason = reason;
  blocks_.pop();
  ++oldest_serial_;
  if (k + 1 < count_ && !entry(k + 1).is_block && entry(k + 1).reason == reason) joinWithNext(k);
  if (k > 0 && entry(k - 1).reason == reason) joinWithNext(k - 1);
  return true;
}

void SampleRing::popFront() {
  if (entry(0).is_block) {
    blocks_.pop();
    ++oldest_serial_;
  }
  samples_ -= entry(0).count;
  head_ = (head_ + 1) % entries_.size();
  --count_;
}

std::optional<Piece> SampleRing::find(SampleIndex sample) const {
  std::size_t low = 0;
  std::size_t high = count_;
  while (low < high) {
    const auto middle = (low + high) / 2;
    if (piece(middle).end() <= sample) {
      low = middle + 1;
    } else {
      high = middle;
    }
  }
  if (low == count_ || sample < entry(low).first) return std::nullopt;
  return piece(low);
}

void SampleRing::clear() {
  oldest_serial_ += blocks_.items();
  blocks_.clear();
  head_ = count_ = 0;
  samples_ = 0;
}

Piece SampleRing::piece(std::size_t k) const {
  const auto& e = entry(k);
  return {e.first, e.count, e.reason,
          e.is_block ? blocks_.at(static_cast<std::size_t>(e.serial - oldest_serial_)) : std::span<const std::byte>{},
          e.descriptor};
}

void SampleRing::append(const Entry& added) {
  entry(count_) = added;
  ++count_;
  samples_ += added.count;
  next_ = added.first + static_cast<std::int64_t>(added.count);
}

// Both are losses. The entries before close up: near the front there are few.
void SampleRing::joinWithNext(std::size_t k) {
  auto& kept = entry(k + 1);
  kept.first = entry(k).first;
  kept.count += entry(k).count;
  kept.reason = joined(entry(k).reason, kept.reason);
  for (; k > 0; --k) entry(k) = entry(k - 1);
  head_ = (head_ + 1) % entries_.size();
  --count_;
}

}  // namespace probebox::stream
