#include <gtest/gtest.h>
#include <random>
#include <vector>

#include "require.hpp"
#include "store_entry.hpp"

// The fuzzer's entry without a fuzzer: bits, bytes and stretches of a store's file turned over, the same every time.
namespace probebox {
namespace {

TEST(StoreFuzz, ADamagedFileSaysNothingThatWasNotStored) {
  std::mt19937_64 random{20261125};
  EXPECT_EQ(feedStore(nullptr, 0), 0);
  for (int round = 0; round < fuzz::rounds(400); ++round) {
    std::vector<std::uint8_t> how{static_cast<std::uint8_t>(random() % 8 == 0 ? random() : 0)};
    for (auto changes = random() % 4; changes > 0; --changes) {
      const auto bits = random() % 2 == 0 ? std::uint64_t{1} << random() % 8 : random();
      const auto count = random() % 2 == 0 ? 0 : random();
      for (const auto byte : {random() % 2, random(), random(), bits, count})
        how.push_back(static_cast<std::uint8_t>(byte));
    }
    ASSERT_EQ(feedStore(how.data(), how.size()), 0) << round;
  }
}

}  // namespace
}  // namespace probebox
