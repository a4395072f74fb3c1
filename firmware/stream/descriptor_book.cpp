#include "firmware/stream/descriptor_book.hpp"

#include <algorithm>

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

}  // namespace probebox::stream
