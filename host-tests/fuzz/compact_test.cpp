#include <gtest/gtest.h>
#include <random>
#include <vector>

#include "compact_entry.hpp"
#include "require.hpp"

// The fuzzer's entry without a fuzzer: a block, then short frames from bytes that are mostly small numbers, the same
// every time.
namespace probebox {
namespace {

TEST(CompactFuzz, RestoresNothingThatNoBoxSends) {
  std::mt19937_64 random{20261130};
  for (int round = 0; round < fuzz::rounds(5000); ++round) {
    std::vector<std::uint8_t> bytes;
    for (auto pieces = 1 + random() % 12; pieces > 0; --pieces) {
      const auto length = random() % 100;
      bytes.push_back(static_cast<std::uint8_t>(pieces % 4 == 0 ? 0 : random() % 5));
      bytes.push_back(static_cast<std::uint8_t>(length));
      for (auto k = length; k > 0; --k)
        bytes.push_back(static_cast<std::uint8_t>(random() % 3 == 0 ? random() : random() % 5));
    }
    ASSERT_EQ(feedCompact(bytes.data(), bytes.size()), 0) << round;
  }
}

}  // namespace
}  // namespace probebox
