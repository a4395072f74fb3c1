#include <array>
#include <gtest/gtest.h>
#include <limits>
#include <rapidcheck.h>
#include <string>
#include <vector>

#include "any_column.hpp"
#include "host-tests/support/innovation.hpp"
#include "host-tests/support/scan_signal.hpp"
#include "protocol/codec/block.hpp"
#include "protocol/codec/kernels.hpp"
#include "protocol/frame/frame.hpp"
#include "protocol/frame/reader.hpp"

namespace probebox::codec {
namespace {

using Bytes = std::vector<std::byte>;

struct Columns {
  BlockHeader header;
  std::vector<ChannelFormat> formats;
  Values columns;
};

Columns anyColumns(std::uint16_t most = 400) {
  Columns s;
  s.formats = *rc::gen::nonEmpty(rc::gen::container<std::vector<ChannelFormat>>(anyFormat()));
  if (s.formats.size() > 6) s.formats.resize(6);
  s.header = {.first = {*rc::gen::arbitrary<std::int64_t>()}, .count = *rc::gen::inRange<std::uint16_t>(1, most)};
  for (const auto& format : s.formats) {
    const auto column = anyColumn(format, s.header.count);
    s.columns.insert(s.columns.end(), column.begin(), column.end());
  }
  return s;
}

Bytes coded(const Columns& s, const Kernels& kernels = codec::kernels()) {
  Bytes block(rawBlockSize(s.formats, s.header.count));
  const auto size = encodeFast(s.header, s.formats, s.columns, block, kernels);
  EXPECT_TRUE(size.ok()) << "the size of raw is always enough";
  block.resize(size ? *size : 0);
  return block;
}

std::vector<ChannelFormat> scanFormats() {
  std::vector<ChannelFormat> all;
  for (const auto bytes : support::ScanSignal::kBytes) all.push_back({bytes, bytes != 2});
  return all;
}

TEST(FastBlock, GivesBackEveryValueAndIsNeverLongerThanRaw) {
  EXPECT_TRUE(rc::check("decode(encode(x)) == x", [] {
    const auto s = anyColumns();
    const auto block = coded(s);
    RC_ASSERT(!block.empty());
    Values columns(s.columns.size());
    const auto summary = decode(block, s.formats, columns);
    RC_ASSERT(summary.ok());
    RC_ASSERT(columns == s.columns);
    RC_ASSERT(summary->profile == Profile::fast);
    RC_ASSERT(summary->header.first == s.header.first);
  }));
}

TEST(FastBlock, DifferencesBeyondTheirTypeWrap) {
  constexpr auto kLow = std::numeric_limits<std::int64_t>::min();
  constexpr auto kHigh = std::numeric_limits<std::int64_t>::max();
  for (const Values& column :
       {Values{kLow, kHigh, kLow, kHigh, kLow}, Values{0, kLow, kHigh, 0, kLow, 1, kHigh, -1, 3, 3, 3, kLow}}) {
    const Columns s{{.count = static_cast<std::uint16_t>(column.size())}, {{8, true}}, column};
    Values back(column.size());
    ASSERT_TRUE(decode(coded(s), s.formats, back).ok());
    EXPECT_EQ(back, column);
  }
}

// Same bytes and same values, whichever inner loops made them and read them.
::testing::AssertionResult sameWithEveryProcessor(const Columns& s) {
  const auto block = coded(s, *allKernels().front().kernels);
  for (const auto& here : allKernels()) {
    const auto name = std::string{here.name} + ", " + std::to_string(s.header.count) + " samples";
    if (coded(s, *here.kernels) != block) return ::testing::AssertionFailure() << "other bytes: " << name;
    Values back(s.columns.size());
    if (!decode(block, s.formats, back, *here.kernels).ok() || back != s.columns)
      return ::testing::AssertionFailure() << "other values: " << name;
  }
  return ::testing::AssertionSuccess();
}

TEST(FastBlock, IsTheSameWithEveryProcessor) {
  if (allKernels().size() == 1) GTEST_SKIP() << "this processor has plain instructions only";
  EXPECT_TRUE(rc::check("all kernels give the same bytes and values", [&] {
    const auto result = sameWithEveryProcessor(anyColumns(600));
    if (!result) RC_FAIL(result.message());
  }));
}

// Noise of so many bits as it is, summed up once, three times, and with something far away now and then: every
// predictor, every width, columns that end anywhere in a group, and tracked alone, in twos, threes and fours.
Columns ofWidth(unsigned width, std::uint16_t count) {
  Columns s{{.first = {7}, .count = count}, std::vector<ChannelFormat>(9, {8, true}), {}};
  std::uint64_t state = 1 + width + 100U * count;
  const auto noise = [&]() -> std::uint64_t {
    state = state * 6364136223846793005U + 1442695040888963407U;
    const auto mixed = (state ^ state >> 29U) * 0x9E3779B97F4A7C15U;
    return width == 0 ? 0 : static_cast<std::uint64_t>(static_cast<std::int64_t>(mixed) >> (64 - width));
  };
  for (std::size_t channel = 0; channel < s.formats.size(); ++channel) {
    std::array<std::uint64_t, 3> sums{noise(), noise(), noise()};
    for (std::size_t k = 0; k < count; ++k) {
      sums[2] += noise() >> (channel % 2);
      sums[1] += sums[2];
      sums[0] += sums[1];
      auto value = channel == 0 ? noise() : channel == 1 ? sums[2] : sums[0] + noise();
      if (channel == 2 && k % 29 == 3)
        value = k % 2 == 0 ? std::uint64_t{1} << 63U : ~(std::uint64_t{1} << 63U);  // the extremes
      s.columns.push_back(static_cast<std::int64_t>(value));
    }
  }
  return s;
}

TEST(FastBlock, IsTheSameForEveryWidthAndLength) {
  for (unsigned width = 0; width <= 64; ++width) {
    for (std::uint16_t count = 1; count <= 300; count = static_cast<std::uint16_t>(count + (count < 70 ? 1 : 7)))
      ASSERT_TRUE(sameWithEveryProcessor(ofWidth(width, count))) << width << " bits";
  }
  for (std::uint16_t count = 1; count <= 300; ++count)
    ASSERT_TRUE(sameWithEveryProcessor(ofWidth(9 + count % 4, count)));
}

// A circle whose direction changes much between two samples, in one to five columns: what has to follow its jerk.
TEST(FastBlock, FollowsJerkTheSameWithEveryProcessor) {
  constexpr std::uint8_t kWithJerk = 5;
  support::ScanSignal scan;
  scan.rate_hz = 1000;
  const auto signal = scan.columns(300, 7);
  const auto x = std::span{signal}.subspan(3 * 300, 300);
  for (std::size_t columns = 1; columns <= 5; ++columns) {
    for (std::uint16_t count = 30; count <= 300; ++count) {
      Columns s{{.count = count}, std::vector<ChannelFormat>(columns, {8, true}), {}};
      for (std::size_t c = 0; c < columns; ++c) s.columns.insert(s.columns.end(), x.begin(), x.begin() + count);
      ASSERT_TRUE(sameWithEveryProcessor(s));
      if (count < 100) continue;
      const auto block = coded(s);
      EXPECT_EQ(std::to_integer<std::uint8_t>(block[kBlockHeaderSize]) & 0x7FU, kWithJerk) << count;
    }
  }
}

TEST(FastBlock, CutAnywhereIsAnErrorAndNeverAValue) {
  EXPECT_TRUE(rc::check("truncated at every byte", [] {
    const auto s = anyColumns(40);
    auto block = coded(s);
    Values columns(s.columns.size());
    for (std::size_t size = 0; size < block.size(); ++size) {
      RC_ASSERT(decode(std::span{block}.first(size), s.formats, columns).error().fault == Fault::truncated);
    }
    block.push_back(std::byte{0});
    RC_ASSERT(decode(block, s.formats, columns).error().fault == Fault::trailing_bytes);
  }));
}

TEST(FastBlock, DamagedIsAnErrorOrValuesThatFitTheirChannels) {
  EXPECT_TRUE(rc::check("any byte changed", [] {
    const auto s = anyColumns(60);
    auto block = coded(s);
    for (int times = *rc::gen::inRange(1, 4); times > 0; --times)
      block[*rc::gen::inRange<std::size_t>(0, block.size())] = static_cast<std::byte>(*rc::gen::inRange(0, 256));
    Values columns(s.formats.size() * 0x10000);
    const auto decoded = decode(block, s.formats, columns);
    if (!decoded) return;
    for (std::size_t c = 0; c < s.formats.size(); ++c) {
      const auto [low, high] = rangeOf(s.formats[c]);
      for (std::size_t k = 0; k < decoded->header.count; ++k) {
        const auto value = columns[c * decoded->header.count + k];
        RC_ASSERT(low <= value && value <= high);
      }
    }
  }));
}

TEST(FastBlock, RefusesWhatRawRefuses) {
  const std::vector<ChannelFormat> formats{{2, true}, {1, false}};
  Bytes block(200);
  const auto refused = encodeFast({.count = 3}, formats, Values{1, 2, 3, 4, 5, 256}, block);
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().fault, Fault::value_does_not_fit);
  EXPECT_EQ(refused.error().channel, 1U);
  EXPECT_EQ(refused.error().sample, 2U);
  EXPECT_EQ(encodeFast({.count = 0}, formats, {}, block).error().fault, Fault::bad_format);
  EXPECT_EQ(encodeFast({.count = 1}, formats, Values{1, 2}, std::span{block}.first(20)).error().fault, Fault::no_room);
  const Values many(kMostFastSamples + 1);
  EXPECT_EQ(encodeFast({.count = kMostFastSamples + 1}, std::span{formats}.first(1), many, block).error().fault,
            Fault::bad_format);
}

// What stands still or moves evenly costs its seeds only.
TEST(FastBlock, WhatCanBeForeseenCostsNothing) {
  Values columns;
  for (int k = 0; k < 200; ++k) columns.push_back(-7'000);
  for (int k = 0; k < 200; ++k) columns.push_back(1'000'000 + 250 * k);
  for (int k = 0; k < 200; ++k) columns.push_back(k == 77 ? 12 : 4);
  const Columns s{{.count = 200}, {{4, true}, {8, true}, {2, false}}, columns};
  EXPECT_LE(coded(s).size(), rawBlockSize(s.formats, 0) + 2 + 5 + 12);
}

// Frozen: recordings hold these bytes. The example of MESSAGES.md.
TEST(FastBlock, HasItsGoldenBytes) {
  const std::vector<ChannelFormat> formats{{4, true}, {2, false}};
  const Values columns{1000, 1003, 1001, 1004, 5002, 5001, 5003, 5004, 5002, 5003, 4, 4, 4, 4, 4, 4, 4, 4, 4, 4};
  Bytes block(rawBlockSize(formats, 10));
  const auto size = encodeFast({.count = 10}, formats, columns, block);
  ASSERT_TRUE(size.ok());
  std::vector<int> got;
  for (const auto byte : std::span{block}.first(*size).subspan(kBlockHeaderSize)) {
    got.push_back(std::to_integer<int>(byte));
  }
  const std::vector<int> golden{0x81, 3,                       // channel 0: first difference with exceptions, 3 bits
                                1,    0,                       // channel 1: first difference, 0 bits
                                0xD0, 0x0F,                    // 1000
                                0xF3, 0x7C, 0xC5, 0x01,        // 3, -2, 3, [6], -1, 2, 1, -2, 1
                                1,    10,   3,    0xF3, 0x01,  // one exception, 10 bits, at 3: 499 x 8 + 6 = 3998
                                8};                            // 4
  EXPECT_EQ(got, golden);
}

// Whole frames of 256 samples with their delimiters, beside the information in the scan. Sent short they have 0.03
// less.
TEST(FastBlock, OfTheReferenceScanIsSmall) {
  constexpr std::size_t kCount = 256, kBlocks = 40, kAll = kCount * kBlocks;
  for (const double rate_hz : {1000.0, 4000.0, 10'000.0}) {
    support::ScanSignal scan;
    scan.rate_hz = rate_hz;
    const auto signal = scan.columns(kAll, 3);
    double bits = 0;
    for (std::size_t c = 0; c < support::ScanSignal::kColumns; ++c)
      bits += support::innovationBits(std::span{signal}.subspan(c * kAll, kAll));
    std::size_t wire = 0;
    Bytes scratch(1U << 15U), into(1U << 15U);
    for (std::size_t b = 0; b < kBlocks; ++b) {
      Columns s{{.count = kCount}, scanFormats(), {}};
      for (std::size_t c = 0; c < s.formats.size(); ++c) {
        const auto from = signal.begin() + static_cast<std::ptrdiff_t>(c * kAll + b * kCount);
        s.columns.insert(s.columns.end(), from, from + kCount);
      }
      wire += frame::encodeDelimited({}, coded(s), scratch, into);
    }
    EXPECT_LE(8 * static_cast<double>(wire) / (kAll * bits), 1.38) << rate_hz;
  }
}

// Each block stands by itself: the goal is at most 1.02 frames lost for a corrupted byte.
TEST(FastBlock, ACorruptedByteCostsOneFrame) {
  constexpr std::size_t kCount = 256, kBlocks = 12;
  const auto signal = support::ScanSignal{}.columns(kCount * kBlocks, 5);
  Bytes wire, scratch(1U << 15U), into(1U << 15U);
  for (std::size_t b = 0; b < kBlocks; ++b) {
    Columns s{{.count = kCount}, scanFormats(), {}};
    for (std::size_t c = 0; c < s.formats.size(); ++c) {
      const auto from = signal.begin() + static_cast<std::ptrdiff_t>((c * kBlocks + b) * kCount);
      s.columns.insert(s.columns.end(), from, from + kCount);
    }
    const auto size = frame::encodeDelimited({}, coded(s), scratch, into);
    wire.insert(wire.end(), into.begin(), into.begin() + static_cast<std::ptrdiff_t>(size));
  }
  std::uint64_t state = 11, lost = 0;
  constexpr std::uint64_t kTimes = 2000;
  for (std::uint64_t k = 0; k < kTimes; ++k) {
    state = state * 6364136223846793005U + 1442695040888963407U;
    auto damaged = wire;
    damaged[(state >> 20U) % wire.size()] ^= static_cast<std::byte>(1 + (state >> 50U) % 255);
    frame::Reader reader;
    std::span<const std::byte> rest{damaged};
    while (reader.next(rest)) {
    }
    lost += kBlocks - reader.counters().frames;
  }
  EXPECT_GE(lost, kTimes) << "nothing damaged is accepted";
  EXPECT_LE(static_cast<double>(lost) / kTimes, 1.02);
}

}  // namespace
}  // namespace probebox::codec
