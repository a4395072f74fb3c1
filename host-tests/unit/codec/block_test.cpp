#include "protocol/codec/block.hpp"

#include <algorithm>
#include <gtest/gtest.h>
#include <limits>
#include <rapidcheck.h>
#include <vector>

#include "any_column.hpp"
#include "protocol/codec/encoder.hpp"

namespace probebox::codec {
namespace {

struct WholeBlock {
  BlockHeader header;
  std::vector<ChannelFormat> formats;
  Values columns;
  std::vector<std::byte> block;
};

WholeBlock anyBlock() {
  WholeBlock s;
  s.formats = *rc::gen::nonEmpty(rc::gen::container<std::vector<ChannelFormat>>(anyFormat()));
  s.header = {.first = {*rc::gen::arbitrary<std::int64_t>()},
              .count = *rc::gen::inRange<std::uint16_t>(1, 40),
              .samples_per_tick = *rc::gen::inRange<std::uint16_t>(1, 101),
              .map = {.tick = {77},
                      .at = monoTime(-5),
                      .period_q32_ns = 1,
                      .sigma_ns = 9,
                      .state = ClockState::holdover,
                      .holdover_ms = 3}};
  for (const auto& format : s.formats) {
    for (int k = 0; k < s.header.count; ++k) s.columns.push_back(anyValue(format));
  }
  s.block.resize(rawBlockSize(s.formats, s.header.count));
  RC_ASSERT(encodeRaw(s.header, s.formats, s.columns, s.block).ok());
  return s;
}

TEST(RawBlock, GivesBackEveryValueOfEveryWidth) {
  EXPECT_TRUE(rc::check("decode(encode(x)) == x", [] {
    const auto s = anyBlock();
    Values columns(s.columns.size());
    const auto summary = decode(s.block, s.formats, columns);
    RC_ASSERT(summary.ok());
    RC_ASSERT(columns == s.columns);
    RC_ASSERT(summary->header.first == s.header.first);
    RC_ASSERT(summary->header.count == s.header.count);
    RC_ASSERT(summary->header.samples_per_tick == s.header.samples_per_tick);
    RC_ASSERT(summary->header.map.at == s.header.map.at);
    RC_ASSERT(summary->header.map.state == s.header.map.state);
    RC_ASSERT(summary->channels == s.formats.size());
  }));
}

TEST(RawBlock, CutAnywhereIsAnErrorAndNeverAValue) {
  EXPECT_TRUE(rc::check("truncated at every byte", [] {
    const auto s = anyBlock();
    Values columns(s.columns.size());
    for (std::size_t size = 0; size < s.block.size(); ++size) {
      const auto cut = decode(std::span{s.block}.first(size), s.formats, columns);
      RC_ASSERT(!cut.ok());
      RC_ASSERT(cut.error().fault == Fault::truncated);
    }
    auto longer = s.block;
    longer.push_back(std::byte{0});
    RC_ASSERT(decode(longer, s.formats, columns).error().fault == Fault::trailing_bytes);
  }));
}

TEST(RawBlock, NamesTheValueThatDoesNotFit) {
  EXPECT_TRUE(rc::check("one value outside fails the block, at its place", [] {
    auto s = anyBlock();
    const auto channel = *rc::gen::inRange<std::size_t>(0, s.formats.size());
    const auto k = *rc::gen::inRange<std::size_t>(0, s.header.count);
    const auto [low, high] = rangeOf(s.formats[channel]);
    RC_PRE(s.formats[channel].bytes < 8 || !s.formats[channel].is_signed);
    const bool above = *rc::gen::arbitrary<bool>() && high < std::numeric_limits<std::int64_t>::max();
    s.columns[channel * s.header.count + k] = above ? high + 1 : low - 1;
    const auto refused = encodeRaw(s.header, s.formats, s.columns, s.block);
    RC_ASSERT(!refused.ok());
    RC_ASSERT(refused.error().fault == Fault::value_does_not_fit);
    RC_ASSERT(refused.error().channel == channel);
    RC_ASSERT(refused.error().sample == k);
  }));
}

TEST(RawBlock, RefusesAnotherDescriptorAndAnotherProfile) {
  const std::vector<ChannelFormat> formats{{4, true}, {2, false}};
  const Values columns{1, 2, 3, 4};
  std::vector<std::byte> block(rawBlockSize(formats, 2));
  ASSERT_TRUE(encodeRaw({.count = 2}, formats, columns, block).ok());
  Values into(12);
  const auto faultWith = [&](std::vector<ChannelFormat> other) { return decode(block, other, into).error().fault; };
  EXPECT_EQ(faultWith({{4, true}}), Fault::other_channels);
  EXPECT_EQ(faultWith({{4, true}, {1, false}}), Fault::other_channels);
  EXPECT_EQ(faultWith({}), Fault::bad_format);
  EXPECT_EQ(faultWith({{4, true}, {3, false}}), Fault::bad_format);
  EXPECT_EQ(decode(block, formats, std::span{into}.first(3)).error().fault, Fault::no_room);
  block[0] = std::byte{7};
  EXPECT_EQ(decode(block, formats, into).error().fault, Fault::unknown_profile);
  block[0] = std::byte{1};
  EXPECT_EQ(inspect(block)->profile, Profile::fast);
}

TEST(RawBlock, RefusesWhatIsNoBlock) {
  const std::vector<ChannelFormat> formats{{4, true}};
  std::vector<std::byte> block(200);
  EXPECT_EQ(encodeRaw({.count = 0}, formats, {}, block).error().fault, Fault::bad_format);
  EXPECT_EQ(encodeRaw({.count = 2}, formats, Values{1}, block).error().fault, Fault::bad_format);
  EXPECT_EQ(encodeRaw({.count = 1}, {}, {}, block).error().fault, Fault::bad_format);
  EXPECT_EQ(encodeRaw({.count = 1}, formats, Values{1}, std::span{block}.first(10)).error().fault, Fault::no_room);
}

// The reference record of 58 bytes less the index and time that the block's header carries.
TEST(RawBlock, HoldsAsManySamplesAsItSays) {
  const std::vector<ChannelFormat> formats{{4, true}, {4, true}, {4, true}, {8, true}, {8, true},
                                           {8, true}, {4, true}, {4, true}, {2, false}};
  EXPECT_EQ(rawBlockSize(formats, 1) - rawBlockSize(formats, 0), 46U);
  for (const std::size_t bytes : {0U, 50U, 109U, 110U, 155U, 156U, 16384U}) {
    const auto capacity = rawBlockCapacity(formats, bytes);
    EXPECT_TRUE(capacity == 0 || rawBlockSize(formats, capacity) <= bytes) << bytes;
    EXPECT_GT(rawBlockSize(formats, capacity + 1), bytes);
  }
}

// Frozen: recordings hold these bytes.
TEST(RawBlock, HasItsGoldenBytes) {
  const std::vector<ChannelFormat> formats{{2, true}, {1, false}};
  const BlockHeader header{.first = {0x0102},
                           .count = 2,
                           .samples_per_tick = 3,
                           .map = {.tick = {5},
                                   .at = monoTime(6),
                                   .period_q32_ns = 7,
                                   .sigma_ns = 8,
                                   .state = ClockState::locked,
                                   .holdover_ms = 9}};
  std::vector<std::byte> block(rawBlockSize(formats, 2));
  ASSERT_EQ(*encodeRaw(header, formats, Values{-2, 3, 255, 0}, block), block.size());
  std::vector<int> got;
  for (const auto byte : block) got.push_back(std::to_integer<int>(byte));
  const std::vector<int> golden{0,                                   // profile raw
                                2,    1,    0,  0, 0,   0, 0, 0,     // first
                                2,    0,    3,  0,                   // count, samples per tick
                                5,    0,    0,  0, 0,   0, 0, 0,     // tick
                                6,    0,    0,  0, 0,   0, 0, 0,     // at
                                7,    0,    0,  0, 0,   0, 0, 0,     // period
                                8,    0,    0,  0, 1,   9, 0, 0, 0,  // sigma, state, holdover
                                2,    0,    16, 0, 8,                // channels: order, width
                                0xFE, 0xFF, 3,  0, 255, 0};          // columns
  EXPECT_EQ(got, golden);
}

TEST(Encoder, CountsWhatItRefuses) {
  Encoder encoder{{{1, true}}, Profile::raw};
  std::vector<std::byte> block(100);
  EXPECT_TRUE(encoder.encode({.count = 2}, Values{127, -128}, block).ok());
  EXPECT_FALSE(encoder.encode({.count = 3}, Values{1, 128, 2}, block).ok());
  EXPECT_EQ(encoder.counters().blocks, 1U);
  EXPECT_EQ(encoder.counters().samples, 2U);
  EXPECT_EQ(encoder.counters().refused_blocks, 1U);
  EXPECT_EQ(encoder.counters().refused_samples, 3U);
  Encoder later{{{1, true}}, static_cast<Profile>(7)};
  EXPECT_EQ(later.encode({.count = 1}, Values{1}, block).error().fault, Fault::unknown_profile);
}

}  // namespace
}  // namespace probebox::codec
