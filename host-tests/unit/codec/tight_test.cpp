#include "protocol/codec/tight.hpp"

#include <array>
#include <gtest/gtest.h>
#include <limits>
#include <rapidcheck.h>
#include <vector>

#include "any_column.hpp"
#include "host-tests/support/innovation.hpp"
#include "host-tests/support/no_alloc.hpp"
#include "host-tests/support/scan_signal.hpp"
#include "protocol/codec/encoder.hpp"
#include "protocol/frame/frame.hpp"

namespace probebox::codec {
namespace {

using support::ScanSignal;
using TightBytes = std::vector<std::byte>;
constexpr std::size_t kKeyEvery = TightEncoder::kKeyEvery;

std::vector<ChannelFormat> formatsOfScan() {
  std::vector<ChannelFormat> all;
  for (const auto bytes : ScanSignal::kBytes) all.push_back({bytes, bytes != 2});
  return all;
}

// Some samples of a signal of `all` samples, column by column.
Values part(const Values& signal, std::size_t all, std::size_t first, std::size_t count) {
  Values some;
  for (std::size_t at = first; at < signal.size(); at += all) some.insert(some.end(), &signal[at], &signal[at] + count);
  return some;
}

bool isKey(const TightBytes& block) {
  return static_cast<Profile>(block[0]) == Profile::tight;
}

// A stream of a scan, block by block, at a rate of 1 kHz.
class ScanStream {
 public:
  explicit ScanStream(std::size_t samples) : samples_{samples}, signal_{ScanSignal{}.columns(samples, 7)} {}

  TightBytes next(std::uint16_t count) {
    header_.count = count;
    columns = part(signal_, samples_, static_cast<std::size_t>(header_.first.index), count);
    TightBytes block(rawBlockSize(encoder.formats(), count));
    const auto size = encoder.encode(header_, columns, block);
    EXPECT_TRUE(size.ok());
    block.resize(size ? *size : 0);
    header_.first = header_.first + static_cast<std::int64_t>(count);
    return block;
  }
  // Whether the decoder gives the values of the last block, and nothing of another one.
  Outcome<BlockSummary, CodecError> decode(const TightBytes& block) {
    Values back(columns.size());
    auto summary = decoder.decode(block, encoder.formats(), back);
    EXPECT_TRUE(!summary || back == columns);
    return summary;
  }

  TightEncoder encoder{formatsOfScan()};
  Decoder decoder;
  Values columns;  // of the last block

 private:
  std::size_t samples_;
  Values signal_;
  BlockHeader header_{};
};

bool sameHeader(const BlockHeader& a, const BlockHeader& b) {
  std::vector<std::byte> bytes_a(100), bytes_b(100);
  frame::ByteWriter writer_a{bytes_a}, writer_b{bytes_b};
  putSummary(writer_a, {Profile::tight, a, 1});
  putSummary(writer_b, {Profile::tight, b, 1});
  return bytes_a == bytes_b;
}

TEST(TightBlock, GivesBackEveryValueAndIsNeverLongerThanRaw) {
  EXPECT_TRUE(rc::check("decode(encode(x)) == x over blocks of one stream", [] {
    auto formats = *rc::gen::nonEmpty(rc::gen::container<std::vector<ChannelFormat>>(anyFormat()));
    if (formats.size() > 5) formats.resize(5);
    TightEncoder encoder{formats};
    Decoder decoder;
    for (auto blocks = *rc::gen::inRange(1, 6); blocks > 0; --blocks) {
      const BlockHeader header{
          .first = {*rc::gen::arbitrary<std::int64_t>()},
          .count = *rc::gen::inRange<std::uint16_t>(1, 513),
          .samples_per_tick = *rc::gen::arbitrary<std::uint16_t>(),
          .map = {.tick = {*rc::gen::arbitrary<std::int64_t>()},
                  .at = monoTime(*rc::gen::arbitrary<std::int64_t>()),
                  .period_q32_ns = *rc::gen::arbitrary<std::int64_t>(),
                  .sigma_ns = *rc::gen::arbitrary<std::uint32_t>(),
                  .state = *rc::gen::element(ClockState::unlocked, ClockState::locked, ClockState::holdover)}};
      Values columns;
      for (const auto& format : formats) {
        const auto column = anyColumn(format, header.count);
        columns.insert(columns.end(), column.begin(), column.end());
      }
      TightBytes block(rawBlockSize(formats, header.count));
      const auto size = encoder.encode(header, columns, block);
      RC_ASSERT(size.ok());
      block.resize(*size);
      Values back(columns.size());
      const auto summary = decoder.decode(block, formats, back);
      RC_ASSERT(summary.ok());
      RC_ASSERT(back == columns);
      RC_ASSERT(sameHeader(summary->header, header));
    }
  }));
}

TEST(TightBlock, CarriesStepsFromOneEndOfTheRangeToTheOther) {
  constexpr auto kLow = std::numeric_limits<std::int64_t>::min();
  constexpr auto kHigh = std::numeric_limits<std::int64_t>::max();
  const std::vector<ChannelFormat> formats{{8, true}};
  TightEncoder encoder{formats};
  Decoder decoder;
  for (int round = 0; round < 20; ++round) {
    Values column;
    for (int k = 0; k < 100; ++k) column.push_back(round % 2 == 0 ? 5 : k % (round + 2) == 0 ? kLow : kHigh);
    TightBytes block(rawBlockSize(formats, column.size()));
    const auto size = encoder.encode({.count = 100}, column, block);
    ASSERT_TRUE(size.ok());
    Values back(column.size());
    ASSERT_TRUE(decoder.decode(std::span{block}.first(*size), formats, back).ok());
    EXPECT_EQ(back, column);
  }
}

TEST(TightBlock, OfAChannelThatStandsStillIsItsHead) {
  TightEncoder encoder{std::vector<ChannelFormat>{{2, false}}};
  TightBytes block(2000);
  ASSERT_TRUE(encoder.encode({.count = 256}, Values(256, 4), block).ok());
  EXPECT_LE(*encoder.encode({.first = {256}, .count = 256}, Values(256, 4), block), 11U);
}

TEST(TightStream, AfterALostBlockNothingIsDecodedUpToTheNextKey) {
  ScanStream stream{2 * kKeyEvery};
  std::size_t decoded = 0, refused = 0;
  for (std::size_t at = 0; at < 2 * kKeyEvery; at += 256) {
    const auto block = stream.next(256);
    EXPECT_EQ(isKey(block), at % kKeyEvery == 0);
    if (at == 512) continue;  // lost
    if (const auto got = stream.decode(block)) {
      EXPECT_EQ(got->header.first.index, static_cast<std::int64_t>(at));
      ++decoded;
    } else {
      EXPECT_EQ(got.error().fault, Fault::no_key);
      ++refused;
    }
  }
  EXPECT_EQ(decoded, 2 + 64U);
  EXPECT_EQ(refused, 61U);
}

TEST(TightStream, HasAKeyAtMostEverySoManySamplesWhateverTheFrames) {
  for (const auto count : std::to_array<std::uint16_t>({1, 7, 64, 300, 512})) {
    ScanStream stream{3 * kKeyEvery};
    std::size_t since_key = 0, keys = 0;
    for (std::size_t at = 0; at + count <= 3 * kKeyEvery && keys < 3; at += count) {
      const auto block = stream.next(count);
      if (isKey(block)) {
        EXPECT_TRUE(keys == 0 || since_key > kKeyEvery - count) << "not more of them than need be, " << count;
        since_key = 0;
        ++keys;
      }
      since_key += count;
      EXPECT_LE(since_key, kKeyEvery) << count;
      ASSERT_TRUE(stream.decode(block).ok()) << count;
    }
    EXPECT_GE(keys, 2U);
  }
}

TEST(TightStream, HasAKeyOnRequest) {
  ScanStream stream{4096};
  ASSERT_TRUE(stream.decode(stream.next(128)).ok());
  stream.next(128);  // lost
  EXPECT_FALSE(stream.decode(stream.next(128)).ok());
  stream.encoder.restart();
  const auto key = stream.next(128);
  EXPECT_TRUE(isKey(key));
  EXPECT_TRUE(stream.decode(key).ok());
  const auto more = stream.next(128);
  EXPECT_FALSE(isKey(more));
  EXPECT_TRUE(stream.decode(more).ok());
}

// Neither two streams nor the order of one's blocks can be mixed up.
TEST(TightStream, TakesNoBlockOfAnotherOne) {
  ScanStream stream{4096};
  const auto first = stream.next(64);
  const auto second = stream.next(64);
  const auto third = stream.next(64);
  Decoder other;
  Values back(9 * 64);
  const auto formats = formatsOfScan();
  EXPECT_EQ(other.decode(second, formats, back).error().fault, Fault::no_key);
  ASSERT_TRUE(other.decode(first, formats, back).ok());
  EXPECT_EQ(other.decode(third, formats, back).error().fault, Fault::no_key);
  ASSERT_TRUE(other.decode(first, formats, back).ok());
  ASSERT_TRUE(other.decode(second, formats, back).ok());
  EXPECT_EQ(other.decode(second, formats, back).error().fault, Fault::no_key);
  EXPECT_EQ(decode(second, formats, back).error().fault, Fault::no_key) << "not without a Decoder";
  EXPECT_EQ(inspect(second).error().fault, Fault::no_key);
  EXPECT_EQ(inspect(first)->header.count, 64);
}

TEST(TightStream, GoesOnAfterMissingSamples) {
  const std::vector<ChannelFormat> formats{{4, true}};
  TightEncoder encoder{formats};
  Decoder decoder;
  TightBytes block(2000);
  Values back(3);
  for (const auto first : std::to_array<std::int64_t>({0, 3, 1000, 1003, 1'000'000'000'000})) {
    const auto size = encoder.encode({.first = {first}, .count = 3}, Values{1, 2, 3}, block);
    ASSERT_TRUE(size.ok());
    EXPECT_EQ(block[0], first == 0 ? std::byte{2} : std::byte{3});
    const auto got = decoder.decode(std::span{block}.first(*size), formats, back);
    ASSERT_TRUE(got.ok());
    EXPECT_EQ(got->header.first.index, first);
  }
}

// Bytes that are missing may be other values' bytes, which the frame's CRC tells; they are not this block's.
TEST(TightStream, RefusesWhatIsCutOrLonger) {
  ScanStream stream{4096};
  const auto first = stream.next(100);
  const auto second = stream.next(100);
  const auto formats = formatsOfScan();
  Values back(9 * 100);
  for (std::size_t size = 0; size < second.size(); ++size) {
    Decoder decoder;
    ASSERT_TRUE(decoder.decode(first, formats, back).ok());
    EXPECT_FALSE(decoder.decode(std::span{second}.first(size), formats, back).ok() && back == stream.columns) << size;
  }
  auto longer = second;
  longer.push_back(std::byte{0});
  Decoder decoder;
  ASSERT_TRUE(decoder.decode(first, formats, back).ok());
  EXPECT_FALSE(decoder.decode(longer, formats, back).ok());
  EXPECT_EQ(decoder.decode(second, formats, back).error().fault, Fault::no_key) << "a refused block ends the stream";
}

TEST(TightStream, OfNoiseIsRawAndBeginsAnewBehindIt) {
  const std::vector<ChannelFormat> formats{{8, true}};
  TightEncoder encoder{formats};
  std::uint64_t state = 3;
  Values noise;
  for (int k = 0; k < 300; ++k)
    noise.push_back(static_cast<std::int64_t>((state = state * 6364136223846793005U + 1442695040888963407U)));
  TightBytes block(rawBlockSize(formats, 300));
  const auto size = encoder.encode({.count = 300}, noise, block);
  ASSERT_TRUE(size.ok());
  EXPECT_EQ(*size, block.size());
  EXPECT_EQ(inspect(block)->profile, Profile::raw);
  const auto after = encoder.encode({.count = 300}, Values(300, 1), block);
  EXPECT_EQ(inspect(std::span{block}.first(*after))->profile, Profile::tight);
}

TEST(TightStream, NamesTheValueThatDoesNotFitAndNeedsAKeyThen) {
  TightEncoder encoder{std::vector<ChannelFormat>{{4, true}, {1, true}}};
  TightBytes block(1000);
  ASSERT_TRUE(encoder.encode({.count = 2}, Values{1, 2, 3, 4}, block).ok());
  const auto refused = encoder.encode({.count = 2}, Values{1, 2, 3, 128}, block);
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().fault, Fault::value_does_not_fit);
  EXPECT_EQ(refused.error().channel, 1);
  EXPECT_EQ(refused.error().sample, 1);
  EXPECT_EQ(encoder.encode({.count = 2}, Values{1, 2, 3, 4}, std::span{block}.first(20)).error().fault, Fault::no_room);
  const auto size = encoder.encode({.count = 2}, Values{1, 2, 3, 4}, block);
  ASSERT_TRUE(size.ok());
  EXPECT_EQ(inspect(std::span{block}.first(*size))->profile, Profile::tight);
}

TEST(TightStream, AllocatesNothingWhileEncoding) {
  Encoder encoder{formatsOfScan(), Profile::tight};
  const auto signal = ScanSignal{}.columns(2048, 3);
  std::vector<Values> blocks;
  for (std::size_t at = 0; at < 2048; at += 256) blocks.push_back(part(signal, 2048, at, 256));
  TightBytes block(rawBlockSize(encoder.formats(), 256));
  const support::NoAlloc guard;
  for (const auto& columns : blocks) ASSERT_TRUE(encoder.encode({.count = 256}, columns, block).ok());
  EXPECT_EQ(guard.allocations(), 0U);
}

// With frame, delimiter, heads and key blocks, against the order-32 linear prediction of each channel, on scans that
// nothing was chosen by.
TEST(TightStream, NeedsLittleMoreThanTheInformationInAScan) {
  constexpr std::size_t kSamples = 2 * kKeyEvery;
  struct Case {
    double rate_hz;
    double speed_mm_s;
    double noise;  // times the usual
  };
  std::uint64_t seed = 100;
  for (const auto& [rate_hz, speed_mm_s, noise] :
       {Case{4000, 250, 1}, {1000, 250, 1}, {10'000, 250, 1}, {2000, 100, 4}}) {
    ScanSignal scan;
    scan.rate_hz = rate_hz;
    scan.speed_mm_s = speed_mm_s;
    scan.deflection_noise_nm *= noise;
    scan.encoder_noise_nm *= noise;
    const auto signal = scan.columns(kSamples, ++seed);
    double information = 0;  // bytes
    for (std::size_t c = 0; c < ScanSignal::kColumns; ++c)
      information += support::innovationBits(std::span{signal}.subspan(c * kSamples, 16'384)) / 8;
    information *= kSamples;
    for (const auto& [count, most] : {std::pair<std::uint16_t, double>{256, 1.10}, {64, 1.15}}) {
      TightEncoder encoder{formatsOfScan()};
      TightBytes block(rawBlockSize(encoder.formats(), count)), scratch(1U << 15U), into(1U << 15U);
      std::size_t wire = 0;
      for (std::size_t at = 0; at < kSamples; at += count) {
        const auto size = encoder.encode({.first = {static_cast<std::int64_t>(at)}, .count = count},
                                         part(signal, kSamples, at, count), block);
        ASSERT_TRUE(size.ok());
        wire += frame::encodeDelimited({}, std::span{block}.first(*size), scratch, into);
      }
      EXPECT_LE(static_cast<double>(wire), most * information) << rate_hz << " Hz, " << count << " a frame";
    }
  }
}

}  // namespace
}  // namespace probebox::codec
