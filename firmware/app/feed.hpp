#pragma once
#include <array>
#include <cstddef>
#include <cstdint>

#include "firmware/app/spsc_queue.hpp"
#include "firmware/box/block_builder.hpp"
#include "firmware/corrections/snapshot.hpp"
#include "firmware/latch/record.hpp"
#include "protocol/units/time.hpp"

namespace probebox::app {

// What the core hands to the links: an encoded block, or samples that are lost.
struct FeedItem {
  enum class Kind : std::uint8_t { block, lost_at_source, lost_in_queue };

  Kind kind{};
  latch::LostReason reason{};
  SampleIndex first{};
  std::uint64_t count{};
  std::uint32_t size{};
  corrections::DelayInForce delay;  // in the samples of the block
  std::array<std::byte, box::BlockBuilder::kMostBytes> bytes{};
};
using Feed = SpscQueue<FeedItem>;

}  // namespace probebox::app
