#include <algorithm>
#include <cstdint>
#include <gtest/gtest.h>
#include <random>
#include <vector>

#include "any_column.hpp"
#include "protocol/codec/block.hpp"
#include "protocol/codec/kernels.hpp"
#include "protocol/frame/crc32c.hpp"

// What one processor encodes, every other one encodes to the same bytes.
namespace probebox::codec {
namespace {

// A walk whose steps have up to so many bits, and now and then a leap; integers only, so that every machine makes the
// same.
Values walk(std::mt19937_64& random, const ChannelFormat& format, std::uint16_t count) {
  const unsigned bits = 8U * format.bytes;
  const unsigned step_bits = 1 + static_cast<unsigned>(random() % bits);
  std::uint64_t at = random();
  Values column;
  for (int i = 0; i < count; ++i) {
    at += random() >> (64 - step_bits);
    at -= std::uint64_t{1} << (step_bits - 1);
    if (random() % 200 == 0) at = random();
    const std::uint64_t kept = at << (64 - bits);
    column.push_back(format.is_signed ? static_cast<std::int64_t>(kept) >> (64 - bits)
                                      : static_cast<std::int64_t>(bits < 64 ? kept >> (64 - bits) : kept >> 1));
  }
  return column;
}

// Frozen: computed on x86-64 with AVX2; arm64 must come to it as well (tools/test --arm64).
TEST(Blocks, OfThousandsOfWalksHaveTheSameBytesOnEveryMachine) {
  std::mt19937_64 random{20251125};
  std::uint32_t sum = 0;
  for (int block = 0; block < 2000; ++block) {
    std::vector<ChannelFormat> formats;
    for (std::uint64_t channels = 1 + random() % 5; channels > 0; --channels) {
      constexpr std::uint8_t kBytes[]{1, 2, 4, 8};
      formats.push_back({kBytes[random() % 4], random() % 3 != 0});
    }
    const BlockHeader header{.first = {static_cast<std::int64_t>(random())},
                             .count = static_cast<std::uint16_t>(1 + random() % 400)};
    Values columns;
    for (const auto& format : formats) {
      const auto column = walk(random, format, header.count);
      columns.insert(columns.end(), column.begin(), column.end());
    }
    std::vector<std::byte> bytes(rawBlockSize(formats, header.count));
    const auto raw = encodeRaw(header, formats, columns, bytes);
    ASSERT_TRUE(raw.ok());
    sum = frame::crc32c(std::span{bytes}.first(*raw), sum);
    const auto fast = encodeFast(header, formats, columns, bytes, kernels());
    ASSERT_TRUE(fast.ok());
    sum = frame::crc32c(std::span{bytes}.first(*fast), sum);
    Values back(columns.size());
    ASSERT_TRUE(decode(std::span{bytes}.first(*fast), formats, back).ok());
    ASSERT_EQ(back, columns);
  }
  EXPECT_EQ(sum, 60533612U);
}

}  // namespace
}  // namespace probebox::codec
