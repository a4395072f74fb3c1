#include <gtest/gtest.h>
#include <random>
#include <rapidcheck.h>

#include "box.hpp"
#include "protocol/compact/compact.hpp"
#include "protocol/frame/crc32c.hpp"

// Short frames are whole again at the host, bit by bit, or they are not used.
namespace probebox::compact {
namespace {

using namespace std::chrono_literals;
using messages::MessageType;

constexpr std::uint32_t kDescriptor = 0xD35C0001;
const std::vector<codec::ChannelFormat> kFormats(9, codec::ChannelFormat{4, true});

// A scan at 1 kS/s with a clock that is corrected at every block.
class Blocks {
 public:
  std::vector<std::byte> next(codec::Profile profile = codec::Profile::fast, std::uint16_t count = 128) {
    std::normal_distribution<double> noise{0, 1};
    header_.first = header_.first + header_.count;
    header_.count = count;
    header_.map.tick = {header_.first.index + count};
    header_.map.period_q32_ns = (1'000'017LL << 32) + static_cast<std::int64_t>(1e7 * noise(random_));
    header_.map.at = monoTime(5'000'000'000 + 1'000'017 * header_.map.tick.index + std::llround(100 * noise(random_)));
    header_.map.sigma_ns = 110 + static_cast<std::uint32_t>(random_() % 5);
    std::vector<std::int64_t> columns(kFormats.size() * count);
    for (std::size_t k = 0; k < columns.size(); ++k) columns[k] = std::llround(1e5 + 30 * noise(random_));
    std::vector<std::byte> bytes(codec::rawBlockSize(kFormats, count));
    const auto size = profile == codec::Profile::raw ? codec::encodeRaw(header_, kFormats, columns, bytes)
                                                     : codec::encodeFast(header_, kFormats, columns, bytes);
    bytes.resize(*size);
    return bytes;
  }

 private:
  std::mt19937_64 random_{1};
  codec::BlockHeader header_{.first = {1000}, .map = {.state = ClockState::locked}};
};

frame::Frame framed(const Payload& payload, std::uint32_t descriptor = kDescriptor) {
  frame::Frame frame;
  frame.header.type = static_cast<std::uint8_t>(payload.type);
  frame.header.payload_length = static_cast<std::uint16_t>(payload.bytes.size());
  frame.header.descriptor_hash = descriptor;
  frame.payload = payload.bytes;
  return frame;
}

bool isOf(const frame::Frame& frame, MessageType type) {
  return static_cast<MessageType>(frame.header.type) == type;
}

bool isBlock(const frame::Frame& frame, const std::vector<std::byte>& block) {
  return isOf(frame, MessageType::samples) && frame.header.descriptor_hash == kDescriptor &&
         frame.header.payload_length == block.size() && std::ranges::equal(frame.payload, block);
}

TEST(ShortFrames, AreTheSameBlocksAgainAndMostOfThemShort) {
  Blocks blocks;
  Shortener shortener{frame::kMaxPayload};
  Restorer restorer;
  int whole = 0;
  std::size_t head_bytes = 0;
  constexpr int kBlocks = 100;
  for (int k = 0; k < kBlocks; ++k) {
    const auto block = blocks.next();
    const auto sent = shortener.samples(block, kDescriptor, monoTime(1) + k * 128ms);
    whole += sent.type == MessageType::samples;
    if (sent.type == MessageType::short_samples)
      head_bytes += sent.bytes.size() + codec::kBlockHeaderSize + 2 * kFormats.size() - block.size();
    EXPECT_TRUE(isBlock(restorer.restore(framed(sent)), block)) << k;
  }
  EXPECT_EQ(whole, 13) << "one a second";
  EXPECT_LT(head_bytes, 30U * (kBlocks - 13)) << "of 65 bytes";
}

TEST(ShortFrames, RestoreWhateverAHeaderHolds) {
  EXPECT_TRUE(rc::check("any header after any other", [] {
    Shortener shortener{frame::kMaxPayload};
    Restorer restorer;
    for (int k = 0; k < 8; ++k) {  // those that would get longer go whole
      codec::BlockHeader header;
      codec::BlockHeader::fields(header, [](auto, auto& value, auto) {
        using T = std::decay_t<decltype(value)>;
        if constexpr (requires { value.index; }) {
          value.index = *rc::gen::arbitrary<std::int64_t>();
        } else if constexpr (std::same_as<T, MonoTime>) {
          value = monoTime(*rc::gen::arbitrary<std::int64_t>());
        } else if constexpr (std::is_enum_v<T>) {
          value = static_cast<T>(*rc::gen::inRange(0, 256));
        } else {
          value = *rc::gen::arbitrary<T>();
        }
      });
      header.count = *rc::gen::inRange<std::uint16_t>(1, 9);
      const std::vector<codec::ChannelFormat> formats(3, codec::ChannelFormat{8, true});
      std::vector<std::int64_t> columns(formats.size() * header.count);
      for (auto& value : columns) value = *rc::gen::arbitrary<std::int64_t>();
      std::vector<std::byte> block(codec::rawBlockSize(formats, header.count));
      block.resize(*codec::encodeFast(header, formats, columns, block));
      RC_ASSERT(isBlock(restorer.restore(framed(shortener.samples(block, kDescriptor, monoTime(k)))), block));
    }
  }));
}

TEST(ShortFrames, AreNotUsedWithoutTheWholeOneThatTheyReferTo) {
  Blocks blocks;
  Shortener shortener{frame::kMaxPayload};
  Restorer late;
  const auto first = shortener.samples(blocks.next(), kDescriptor, monoTime(0)).type;
  EXPECT_EQ(first, MessageType::samples);
  const auto head = shortener.headDue(kDescriptor);
  const std::vector<std::byte> kept{head.begin(), head.end()};
  EXPECT_TRUE(shortener.headDue(kDescriptor).empty()) << "once";
  const auto block = blocks.next();
  const auto sent = shortener.samples(block, kDescriptor, monoTime(0));
  EXPECT_TRUE(isOf(late.restore(framed(sent)), MessageType::short_samples));
  EXPECT_TRUE(late.isBaseless(framed(sent)));
  // Under another descriptor it is another head.
  late.restore(framed({MessageType::samples_head, kept}, kDescriptor + 1));
  EXPECT_TRUE(isOf(late.restore(framed(sent)), MessageType::short_samples));
  late.restore(framed({MessageType::samples_head, kept}));
  EXPECT_TRUE(isBlock(late.restore(framed(sent)), block));
  for (std::size_t size = 0; size < 30; ++size)
    EXPECT_FALSE(isBlock(late.restore(framed({sent.type, sent.bytes.first(size)})), block)) << size;
}

TEST(ShortFrames, HeartbeatsAreTheSameAgain) {
  Shortener shortener{frame::kMaxPayload};
  Restorer restorer, late;
  messages::Heartbeat beat{.streaming = true, .stream_number = 1, .clock_state = ClockState::locked};
  std::size_t bytes = 0;
  for (int k = 0; k < 100; ++k) {
    beat.uptime_ms += 100;
    beat.position = beat.position + 100;
    beat.produced += 100;
    beat.sent_samples += 100;
    beat.sent_bytes += 900;
    beat.edges.accepted += 100;
    beat.clock_sigma_ns = 100 + static_cast<std::uint32_t>(k % 7);
    beat.link.frames += 1;
    const auto sent = shortener.heartbeat(beat, monoTime(0) + k * 100ms);
    EXPECT_EQ(sent.type == MessageType::heartbeat, k == 0) << k;
    bytes += sent.bytes.size();
    const auto whole = messages::encoded(beat);
    const auto restored = restorer.restore(framed(sent));
    EXPECT_TRUE(std::ranges::equal(restored.payload, whole)) << k;
    EXPECT_TRUE(isOf(restored, MessageType::heartbeat)) << k;
    if (k >= 5) {
      EXPECT_EQ(isOf(late.restore(framed(sent)), MessageType::heartbeat), k >= 10)
          << "one a second stands by itself " << k;
    }
  }
  EXPECT_LT(5 * bytes, 100 * messages::encodedSize(beat));
  beat.streaming = false;
  EXPECT_EQ(shortener.heartbeat(beat, monoTime(0) + 9901ms).type, MessageType::heartbeat) << "closes the stream";
}

// A box of a later minor version has more numbers in its heartbeats: what names one is what travelled, not what this
// host makes of it.
TEST(ShortFrames, AHostOfAnEarlierMinorRestoresHeartbeatsToo) {
  const auto named = [](std::uint32_t crc, std::vector<std::byte> bytes) {
    frame::storeLittle(crc, bytes.data());
    return bytes;
  };
  Shortener shortener{frame::kMaxPayload};
  Restorer restorer;
  messages::Heartbeat beat{.streaming = true, .stream_number = 1, .produced = 7, .lost_triggers = 3};
  const auto next = [&](Nanoseconds at) {
    ++beat.produced;
    const auto bytes = shortener.heartbeat(beat, monoTime(0) + at).bytes;
    return std::vector<std::byte>{bytes.begin(), bytes.end()};
  };
  const auto isBeat = [&](MessageType type, const std::vector<std::byte>& bytes) {
    const auto restored = restorer.restore(framed({type, bytes}));
    return isOf(restored, MessageType::heartbeat) && std::ranges::equal(restored.payload, messages::encoded(beat));
  };
  auto whole = next(0s);
  whole.push_back(std::byte{42});
  restorer.restore(framed({MessageType::heartbeat, whole}));
  EXPECT_TRUE(isBeat(MessageType::heartbeat_change, named(frame::crc32c(whole), next(100ms))));
  auto from_zeros = next(2s);
  const auto bits = std::to_integer<std::size_t>(from_zeros[4]);
  from_zeros[4] = static_cast<std::byte>(bits + 1);
  from_zeros.insert(from_zeros.begin() + static_cast<std::ptrdiff_t>(5 + bits), std::byte{1});
  from_zeros.push_back(std::byte{42});
  EXPECT_TRUE(isBeat(MessageType::heartbeat_change, from_zeros));
  EXPECT_TRUE(isBeat(MessageType::heartbeat_change, named(frame::crc32c(from_zeros), next(2100ms))));
}

// A host that hears this frame between samples 0 to 9 and 20 to 29 of a stream.
class Between {
 public:
  Between(MessageType type, const std::vector<std::byte>& payload) {
    hear(MessageType::welcome, messages::encoded(messages::Welcome{}));
    hear(MessageType::samples, stream::block({0}, 10));
    hear(type, payload);
    hear(MessageType::samples, stream::block({20}, 10));
  }
  std::uint64_t baseless() const { return host_.reader.faults().baseless; }
  std::uint64_t malformed() const { return host_.reader.faults().malformed; }
  // Samples of the hole that no lost frame excuses.
  std::uint64_t unexplained() const { return host_.reader.ledger().unexplained(); }

 private:
  void hear(MessageType type, const std::vector<std::byte>& payload) {
    std::vector<std::byte> scratch(frame::bareSize(payload.size()));
    std::vector<std::byte> coded(frame::delimitedMaxSize(payload.size()));
    coded.resize(frame::encodeDelimited(
        {.major = messages::kProtocolMajor, .type = static_cast<std::uint8_t>(type), .sequence = sequence_++}, payload,
        scratch, coded));
    host_.read(coded);
  }

  stream::Host host_;
  std::uint32_t sequence_{};
};

TEST(ShortFrames, OnlyABlockThatRefersToNothingExcusesAHole) {
  const std::vector<std::byte> strange(20, std::byte{0x5A});
  const std::vector<std::byte> cut_off(3);
  const Between block{MessageType::short_samples, strange};
  EXPECT_EQ(block.baseless(), 1U);
  EXPECT_EQ(block.unexplained(), 0U) << "its samples are the missing ones";
  const Between beat{MessageType::heartbeat_change, strange};
  EXPECT_EQ(beat.baseless(), 1U);
  EXPECT_EQ(beat.unexplained(), 10U) << "a heartbeat has none";
  for (const auto type : {MessageType::short_samples, MessageType::heartbeat_change}) {
    const Between cut{type, cut_off};
    EXPECT_EQ(cut.baseless(), 0U);
    EXPECT_EQ(cut.malformed(), 1U) << "what it refers to is not in it";
    EXPECT_EQ(cut.unexplained(), 10U);
  }
}

TEST(ShortFrames, NoHeadIsSentToAHostThatHasGone) {
  stream::Box box;
  stream::Host host;
  stream::begin(box, host);
  box.produce(32);
  for (int k = 0; k < 10'000 && !host.heard(MessageType::samples); ++k) host.read(box.take(1));
  ASSERT_TRUE(host.heard(MessageType::samples));
  box.advance(60s);
  ASSERT_EQ(box.session.state(), stream::SessionState::down);
  EXPECT_TRUE(box.take().empty());
}

// Any one frame that is damaged costs its own samples, and no others.
TEST(ShortFrames, ALostFrameCostsNoOther) {
  constexpr int kRounds = 30;
  std::size_t frames = 1;
  for (std::size_t lost = 0; lost < frames; ++lost) {
    stream::Box box;
    stream::Host host;
    stream::begin(box, host, {.profile = messages::Profile::fast});
    host.read(box.take());
    std::size_t n = 0;
    for (int round = 0; round < kRounds; ++round) {
      box.produce(32);
      box.hear(messages::Credit{0});
      box.advance(50ms);
      auto bytes = box.take();
      for (std::size_t at = 0; at < bytes.size();) {
        const auto end = std::find(bytes.begin() + static_cast<std::ptrdiff_t>(at), bytes.end(), std::byte{0});
        if (n++ == lost) bytes[at + 3] ^= std::byte{0x55};
        at = static_cast<std::size_t>(end - bytes.begin()) + 1;
      }
      host.read(bytes);
    }
    frames = n;
    EXPECT_LE(host.reader.ledger().account().inferred_lost, 32U) << "frame " << lost;
    EXPECT_GE(host.received, 32U * (kRounds - 1)) << "frame " << lost;
    EXPECT_EQ(host.wrong_values, 0U);
    for (const auto& balance : host.balances) EXPECT_TRUE(!balance || balance->exact);
  }
  EXPECT_GT(frames, 40U);
}

}  // namespace
}  // namespace probebox::compact
