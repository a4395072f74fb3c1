#pragma once
#include <array>
#include <cstddef>
#include <cstdint>

#include "firmware/app/threads/spsc_queue.hpp"
#include "firmware/box/block_builder.hpp"
#include "firmware/box/placed_trigger.hpp"
#include "firmware/latch/record.hpp"
#include "protocol/messages/types.hpp"
#include "protocol/state/snapshot.hpp"
#include "protocol/units/time.hpp"

namespace probebox::app {

// One item from the core for the links: an encoded block, lost samples, or a trigger.
struct FeedItem {
  enum class Kind : std::uint8_t { block, lost_at_source, lost_in_queue, trigger };

  Kind kind{};
  latch::LostReason reason{};
  SampleIndex first{};
  std::uint64_t count{};
  std::uint32_t size{};
  published::DelayInForce delay;  // applied to the samples of the block
  published::ToolInSamples tool;  // as the block was closed
  std::uint32_t next_trigger{};   // with a block: all earlier triggers were given to the links or are lost
  box::PlacedTrigger trigger;
  std::array<std::byte, box::BlockBuilder::kMostBytes> bytes{};
};
using Feed = SpscQueue<FeedItem>;

// Reason of a loss at the source in messages.
messages::GapReason wireReason(latch::LostReason reason);

}  // namespace probebox::app
