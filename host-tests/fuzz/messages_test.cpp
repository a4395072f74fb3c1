#include <gtest/gtest.h>
#include <random>
#include <vector>

#include "messages_entry.hpp"
#include "require.hpp"

// The fuzzer's entry without a fuzzer: every kind of message from bytes that are mostly small numbers, as counts,
// lengths and flags are, the same every time.
namespace probebox {
namespace {

TEST(MessagesFuzz, WhatIsUnderstoodComesBack) {
  std::mt19937_64 random{20261125};
  for (int round = 0; round < fuzz::rounds(20'000); ++round) {
    std::vector<std::uint8_t> bytes(1 + random() % 400);
    for (auto& byte : bytes) byte = static_cast<std::uint8_t>(random() % 4 == 0 ? random() : random() % 5);
    bytes[0] = static_cast<std::uint8_t>(static_cast<std::size_t>(round) % kindsOfMessages());
    ASSERT_EQ(feedMessages(bytes.data(), bytes.size()), 0) << round;
  }
}

}  // namespace
}  // namespace probebox
