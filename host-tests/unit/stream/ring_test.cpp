#include <deque>
#include <gtest/gtest.h>
#include <rapidcheck.h>

#include "firmware/stream/byte_fifo.hpp"
#include "firmware/stream/sample_ring.hpp"

namespace probebox::stream {
namespace {

TEST(ByteFifo, IsAQueueOfWholeItems) {
  EXPECT_TRUE(rc::check("behaves as a deque of byte strings within its bounds", [] {
    ByteFifo fifo{256, 12};
    std::deque<std::vector<std::byte>> model;
    std::size_t held = 0;
    for (int step = 0; step < 200; ++step) {
      const auto size = *rc::gen::inRange<std::size_t>(1, 40);
      if (*rc::gen::arbitrary<bool>()) {
        const std::vector<std::byte> item(size, static_cast<std::byte>(step));
        if (fifo.push(item)) {
          model.push_back(item);
          held += size;
        } else {
          // Never refuses what fits when the free bytes are split in two, beside what a wrap wasted.
          RC_ASSERT(model.size() == 12U || held + 2 * size + 39U > 256U);
        }
      } else if (!model.empty()) {
        held -= model.front().size();
        model.pop_front();
        fifo.pop();
      }
      RC_ASSERT(fifo.items() == model.size());
      RC_ASSERT(fifo.bytes() == held);
      for (std::size_t k = 0; k < model.size(); ++k) RC_ASSERT(std::ranges::equal(fifo.at(k), model[k]));
    }
  }));
}

TEST(SampleRing, KeepsEveryIndexWhateverIsGivenUp) {
  EXPECT_TRUE(rc::check("pieces are contiguous, counted, and blocks keep their bytes", [] {
    SampleRing ring{200, 8};
    SampleIndex next{5};
    SampleIndex oldest{5};
    for (int step = 0; step < 150; ++step) {
      const auto count = *rc::gen::inRange<std::uint32_t>(1, 30);
      switch (*rc::gen::inRange(0, 5)) {
        case 0:
        case 1: {
          const std::vector<std::byte> bytes(count, static_cast<std::byte>(next.index));
          if (ring.pushBlock({next, count, bytes})) next = next + count;
          break;
        }
        case 2:
          ring.pushGap({next, count, static_cast<GapReason>(count % 6)});
          next = next + count;
          break;
        case 3:
          ring.giveUpOldest(GapReason::queue_full);
          break;
        default:
          if (!ring.empty()) {
            oldest = ring.front().end();
            ring.popFront();
          }
      }
      RC_ASSERT(ring.samples() == static_cast<std::uint64_t>(next - oldest));
      for (auto at = oldest; at < next;) {
        const auto piece = ring.find(at);
        RC_ASSERT(piece.has_value());
        RC_ASSERT(piece->first == at);
        if (piece->isBlock()) {
          RC_ASSERT(piece->bytes.size() == piece->count);
          RC_ASSERT(piece->bytes[0] == static_cast<std::byte>(at.index));
        }
        at = piece->end();
      }
      RC_ASSERT(!ring.find(next).has_value());
    }
  }));
}

}  // namespace
}  // namespace probebox::stream
