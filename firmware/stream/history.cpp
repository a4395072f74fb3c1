#include "firmware/stream/history.hpp"

namespace probebox::stream {

void History::push(const EncodedBlock& block) {
  if (!reach(block.first)) return;
  bool kept = ring_.pushBlock(block);
  while (!kept && !ring_.empty()) {
    ring_.popFront();
    kept = ring_.pushBlock(block);
  }
  if (!kept) ring_.pushGap({block.first, block.count, GapReason::ring_overrun});
}

void History::push(const GapNotice& gap) {
  const auto end = gap.first + static_cast<std::int64_t>(gap.count);
  if (begun_ && end <= ring_.next()) return;
  if (!begun_ || gap.first > ring_.next()) {
    reach(gap.first);
    ring_.pushGap(gap);
  } else {
    ring_.pushGap({ring_.next(), static_cast<std::uint64_t>(end - ring_.next()), gap.reason});
  }
}

bool History::reach(SampleIndex first) {
  if (begun_ && first < ring_.next()) return false;
  if (begun_ && first > ring_.next()) {
    ring_.pushGap({ring_.next(), static_cast<std::uint64_t>(first - ring_.next()), GapReason::source_clock});
  }
  begun_ = true;
  return true;
}

}  // namespace probebox::stream
