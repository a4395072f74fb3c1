#include "firmware/stream/history.hpp"

#include <algorithm>
#include <utility>

#include "protocol/frame/crc32c.hpp"

namespace probebox::stream {

void DescriptorBook::add(std::span<const std::byte> encoded) {
  const auto hash = frame::crc32c(encoded);
  // One that comes back is the newest again.
  std::erase_if(known_, [hash](const Known& known) { return known.hash == hash; });
  known_.push_back({hash, {encoded.begin(), encoded.end()}});
  if (known_.size() > kKept) known_.pop_front();
}

std::span<const std::byte> DescriptorBook::find(std::uint32_t hash) const {
  const auto found = std::ranges::find(known_, hash, &Known::hash);
  return found == known_.end() ? std::span<const std::byte>{} : found->encoded;
}

History::History(std::size_t bytes, std::size_t pieces, std::vector<messages::Profile> others, TriggerHistory triggers)
    : triggers_{std::move(triggers)} {
  lines_.push_back({messages::Profile::raw, SampleRing{bytes, pieces}, false});
  for (const auto profile : others) lines_.push_back({profile, SampleRing{bytes, pieces}, false});
}

const History::Line* History::lineOf(messages::Profile profile) const {
  const auto found = std::ranges::find(lines_, profile, &Line::profile);
  return found == lines_.end() ? nullptr : &*found;
}

SampleIndex History::oldest(messages::Profile profile) const {
  const auto& ring = lineOf(profile)->ring;
  return ring.empty() ? ring.next() : ring.front().first;
}

void History::push(const EncodedBlock& block) {
  const auto found = std::ranges::find(lines_, block.profile, &Line::profile);
  if (found == lines_.end() || !reach(*found, block.first)) return;
  auto& ring = found->ring;
  const auto descriptor = descriptors_.current();
  bool kept = ring.pushBlock(block, descriptor);
  while (!kept && !ring.empty()) {
    ring.popFront();
    kept = ring.pushBlock(block, descriptor);
  }
  if (!kept) ring.pushGap({block.first, block.count, GapReason::ring_overrun});
}

void History::push(const GapNotice& gap) {
  for (auto& line : lines_) push(line, gap);
}

void History::push(Line& line, const GapNotice& gap) {
  const auto end = gap.first + static_cast<std::int64_t>(gap.count);
  if (line.begun && end <= line.ring.next()) return;
  if (!line.begun || gap.first > line.ring.next()) {
    reach(line, gap.first);
    line.ring.pushGap(gap);
  } else {
    line.ring.pushGap({line.ring.next(), static_cast<std::uint64_t>(end - line.ring.next()), gap.reason});
  }
}

bool History::reach(Line& line, SampleIndex first) {
  auto& ring = line.ring;
  if (line.begun && first < ring.next()) return false;
  if (line.begun && first > ring.next())
    ring.pushGap({ring.next(), static_cast<std::uint64_t>(first - ring.next()), GapReason::source_clock});
  line.begun = true;
  return true;
}

}  // namespace probebox::stream
