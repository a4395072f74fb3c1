#include <algorithm>
#include <cstdint>
#include <gtest/gtest.h>
#include <random>
#include <vector>

#include "any_column.hpp"
#include "protocol/codec/block.hpp"
#include "protocol/codec/kernels.hpp"
#include "protocol/codec/tight.hpp"
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
  EXPECT_EQ(sum, 763327770U);
}

// Its predictors calculate in double precision: to the last bit the same everywhere, for walks of every size and for
// leaps. Frozen as the one above.
TEST(Blocks, OfATightStreamHaveTheSameBytesOnEveryMachine) {
  std::mt19937_64 random{20261130};
  std::uint32_t sum = 0;
  for (int stream = 0; stream < 60; ++stream) {
    std::vector<ChannelFormat> formats;
    for (std::uint64_t channels = 1 + random() % 4; channels > 0; --channels) {
      constexpr std::uint8_t kBytes[]{1, 2, 4, 8};
      formats.push_back({kBytes[random() % 4], random() % 3 != 0});
    }
    TightEncoder encoder{formats};
    Decoder decoder;
    std::int64_t first = 0;
    for (std::uint64_t blocks = 1 + random() % 20; blocks > 0; --blocks) {
      const BlockHeader header{.first = {first}, .count = static_cast<std::uint16_t>(1 + random() % 400)};
      first += header.count;
      Values columns;
      for (const auto& format : formats) {
        const auto column = walk(random, format, header.count);
        columns.insert(columns.end(), column.begin(), column.end());
      }
      std::vector<std::byte> bytes(rawBlockSize(formats, header.count));
      const auto tight = encoder.encode(header, columns, bytes);
      ASSERT_TRUE(tight.ok());
      sum = frame::crc32c(std::span{bytes}.first(*tight), sum);
      Values back(columns.size());
      ASSERT_TRUE(decoder.decode(std::span{bytes}.first(*tight), formats, back).ok());
      ASSERT_EQ(back, columns);
    }
  }
  EXPECT_EQ(sum, 2751402311U);
}

// Frozen: recordings hold these bytes.
TEST(TightBlock, HasItsGoldenBytes) {
  TightEncoder encoder{std::vector<ChannelFormat>{{4, true}}};
  std::vector<std::byte> block(200);
  std::vector<int> got;
  for (const std::int64_t first : {0, 12}) {
    Values column;
    for (std::int64_t k = first; k < first + 12; ++k) column.push_back(1000 + 3 * k + (k * k) % 5);
    const auto size = encoder.encode({.first = {first}, .count = 12}, column, block);
    ASSERT_TRUE(size.ok());
    for (const auto byte : std::span{block}.first(*size)) got.push_back(std::to_integer<int>(byte));
  }
  std::vector<int> golden{2,                                                   // profile tight, a key block
                          0,  0, 0, 0, 0, 0, 0, 0,                             // first
                          12, 0, 1, 0};                                        // count, samples per tick
  golden.insert(golden.end(), 33, 0);                                          // the map
  for (const int byte : {1,   0,   32,                                         // channels: order, width
                         23,  232, 4,   1,   8,   55, 212, 195, 163, 222, 45,  // residuals
                         3,                                                    // continued
                         134, 102, 210, 247,                                   // CRC-32C of the block before
                         2,   8,   0,  // what has changed of the header: `tick` has not gone on
                         23,  194, 217, 248, 228, 53})
    golden.push_back(byte);
  EXPECT_EQ(got, golden);
}

}  // namespace
}  // namespace probebox::codec
