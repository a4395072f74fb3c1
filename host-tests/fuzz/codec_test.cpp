#include <algorithm>
#include <gtest/gtest.h>
#include <random>
#include <vector>

#include "codec_entry.hpp"
#include "protocol/codec/encoder.hpp"

// The fuzzer's entry without a fuzzer: good blocks of every profile, the same ones damaged, and noise, the same every
// time.
namespace probebox {
namespace {

using Bytes = std::vector<std::uint8_t>;

// A block of the one channel, signed and of one byte, that the entry reads behind a 0.
Bytes goodBlock(std::mt19937_64& random) {
  const std::vector<codec::ChannelFormat> formats{{1, true}};
  std::vector<std::int64_t> column(1 + random() % 300);
  std::int64_t place = 0;
  for (auto& value : column) {
    place += static_cast<std::int64_t>(random() % 5) - 2;
    value = random() % 50 == 0 ? 100 : place = std::clamp<std::int64_t>(place, -100, 100);
  }
  std::vector<std::byte> block(codec::rawBlockSize(formats, column.size()));
  const codec::BlockHeader header{.count = static_cast<std::uint16_t>(column.size())};
  const auto profile = static_cast<codec::Profile>(random() % 3);
  const auto size = codec::Encoder{formats, profile}.encode(header, column, block);
  Bytes bytes{0};
  for (const auto byte : std::span{block}.first(*size)) bytes.push_back(std::to_integer<std::uint8_t>(byte));
  return bytes;
}

TEST(CodecFuzz, GoodAndDamagedBlocksAreRefusedOrComeBack) {
  std::mt19937_64 random{20260401};
  EXPECT_EQ(feedCodec(nullptr, 0), 0);
  for (int round = 0; round < 5000; ++round) {
    auto bytes = goodBlock(random);
    ASSERT_EQ(feedCodec(bytes.data(), bytes.size()), 0) << round;
    for (std::size_t times = 1 + random() % 4; times > 0; --times) {
      const auto behind_the_header = 48 + random() % (bytes.size() - 48);
      bytes[behind_the_header] = static_cast<std::uint8_t>(random());
    }
    ASSERT_EQ(feedCodec(bytes.data(), bytes.size()), 0) << round;
    bytes.resize(1 + random() % bytes.size());
    ASSERT_EQ(feedCodec(bytes.data(), bytes.size()), 0) << round;
  }
}

TEST(CodecFuzz, NoiseIsRefusedOrComesBack) {
  std::mt19937_64 random{5};
  for (int round = 0; round < 1000; ++round) {
    Bytes noise(1 + random() % 4000);
    for (auto& byte : noise) byte = static_cast<std::uint8_t>(random());
    ASSERT_EQ(feedCodec(noise.data(), noise.size()), 0) << round;
  }
}

}  // namespace
}  // namespace probebox
