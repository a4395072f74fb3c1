#include "protocol/frame/reader.hpp"

#include <algorithm>
#include <gtest/gtest.h>
#include <rapidcheck.h>

#include "random_bytes.hpp"

namespace probebox::frame {
namespace {

ByteVector delimited(std::uint32_t sequence, const ByteVector& payload) {
  ByteVector scratch(bareSize(payload.size()));
  ByteVector coded(delimitedMaxSize(payload.size()));
  coded.resize(encodeDelimited({.type = 8, .sequence = sequence}, payload, scratch, coded));
  return coded;
}

ByteVector bare(std::uint32_t sequence, const ByteVector& payload) {
  ByteVector frame(bareSize(payload.size()));
  frame.resize(encodeBare({.type = 8, .sequence = sequence}, payload, frame));
  return frame;
}

void append(ByteVector& to, const ByteVector& more) {
  to.insert(to.end(), more.begin(), more.end());
}

struct Received {
  std::uint32_t sequence{};
  ByteVector payload;
  friend bool operator==(const Received&, const Received&) = default;
};

std::vector<Received> readAll(Reader& reader, std::span<const std::byte> bytes) {
  std::vector<Received> all;
  while (const auto frame = reader.next(bytes)) {
    all.push_back({frame->header.sequence, {frame->payload.begin(), frame->payload.end()}});
  }
  return all;
}

// Each framing, whatever is asked of both.
class EitherReader : public testing::TestWithParam<Framing> {
 protected:
  static ByteVector framed(std::uint32_t sequence, const ByteVector& payload) {
    return GetParam() == Framing::bare ? bare(sequence, payload) : delimited(sequence, payload);
  }
};
INSTANTIATE_TEST_SUITE_P(, EitherReader, testing::Values(Framing::delimited, Framing::bare),
                         [](const auto& framing) { return framing.param == Framing::bare ? "bare" : "delimited"; });

TEST_P(EitherReader, FindsFramesHoweverTheBytesAreCut) {
  EXPECT_TRUE(rc::check("any cut gives the same frames", [] {
    const auto payloads = *rc::gen::container<std::vector<ByteVector>>(anyBytes(100));
    ByteVector wire;
    std::vector<Received> sent;
    for (const auto& payload : payloads) {
      sent.push_back({static_cast<std::uint32_t>(sent.size()), payload});
      append(wire, framed(sent.back().sequence, payload));
    }
    Reader reader{128, GetParam()};
    std::vector<Received> received;
    std::span<const std::byte> rest{wire};
    while (!rest.empty()) {
      const auto length = *rc::gen::inRange<std::size_t>(1, rest.size() + 1);
      for (auto& frame : readAll(reader, rest.first(length))) received.push_back(std::move(frame));
      rest = rest.subspan(length);
    }
    RC_ASSERT(received == sent);
    RC_ASSERT(reader.counters().frames == sent.size());
    RC_ASSERT(reader.counters().bad() == 0U);
    RC_ASSERT(reader.counters().discarded_bytes == 0U);
  }));
}

TEST(Reader, NeverLosesTheGoodFrameAfterGarbage) {
  EXPECT_TRUE(rc::check("garbage, delimiter, frame: the frame arrives", [] {
    const auto payloads = *rc::gen::container<std::vector<ByteVector>>(anyBytes(60));
    ByteVector wire;
    std::vector<Received> sent;
    std::uint64_t garbage_bytes = 0;
    for (const auto& payload : payloads) {
      const auto garbage = *anyBytes(300);
      append(wire, garbage);
      wire.push_back(kDelimiter);
      garbage_bytes +=
          static_cast<std::uint64_t>(std::ranges::count_if(garbage, [](auto b) { return b != kDelimiter; }));
      sent.push_back({static_cast<std::uint32_t>(sent.size()), payload});
      append(wire, delimited(sent.back().sequence, payload));
    }
    Reader reader{128};
    RC_ASSERT(readAll(reader, wire) == sent);
    RC_ASSERT(reader.counters().discarded_bytes == garbage_bytes);
  }));
}

// A wrong byte costs its own frame; when it falls on a delimiter, the two frames that it joins.
TEST(Reader, OneDamagedByteCostsAtMostTheFramesItTouches) {
  ByteVector wire;
  std::vector<std::size_t> ends;
  for (std::uint32_t k = 0; k < 5; ++k) {
    append(wire, delimited(k, ByteVector(40, std::byte{static_cast<unsigned char>(k)})));
    ends.push_back(wire.size());
  }
  for (std::size_t at = 0; at < wire.size(); ++at) {
    for (const int flip : {0x01, 0x80, 0xFF}) {
      auto damaged = wire;
      damaged[at] ^= static_cast<std::byte>(flip);
      Reader reader;
      const auto received = readAll(reader, damaged);
      const bool on_delimiter = std::ranges::find(ends, at + 1) != ends.end();
      EXPECT_GE(received.size(), on_delimiter ? 3U : 4U) << at;
      EXPECT_LT(received.size(), 5U) << at;
      for (const auto& frame : received) {
        EXPECT_EQ(frame.payload, ByteVector(40, static_cast<std::byte>(frame.sequence)));
      }
    }
  }
}

TEST(Reader, TellsWhatWasWrong) {
  Reader reader{64};
  auto wire = delimited(0, ByteVector(65));    // beyond what the reader takes
  append(wire, ByteVector(40, std::byte{9}));  // a run that ends beyond the delimiter
  append(wire, bytes({0}));
  append(wire, bytes({2, 1, 0}));    // COBS of one byte: too short for a frame
  append(wire, bytes({200, 1, 0}));  // a run beyond the end
  auto damaged = delimited(1, bytes({1, 2, 3}));
  damaged[damaged.size() - 2] ^= std::byte{0x04};
  append(wire, damaged);
  append(wire, bytes({0, 0, 0}));  // idle line
  append(wire, delimited(2, {}));
  EXPECT_EQ(readAll(reader, wire).size(), 1U);
  const auto& counters = reader.counters();
  EXPECT_EQ(counters.frames, 1U);
  EXPECT_EQ(counters.oversize, 1U);
  EXPECT_EQ(counters.bad_length, 1U);
  EXPECT_EQ(counters.bad_cobs, 2U);
  EXPECT_EQ(counters.bad_crc, 1U);
}

// Bytes that can be the beginning of no frame push out whatever still waits for its end.
ByteVector noFrame(std::size_t size) {
  return ByteVector(size, std::byte{0xFF});
}

TEST(Reader, FindsBareFramesAfterGarbageWithoutADelimiter) {
  EXPECT_TRUE(rc::check("garbage, frame, garbage, frame: all frames arrive, all other bytes are counted", [] {
    const auto payloads = *rc::gen::container<std::vector<ByteVector>>(anyBytes(60));
    ByteVector wire;
    std::vector<Received> sent;
    std::uint64_t garbage_bytes = 0;
    for (const auto& payload : payloads) {
      const auto garbage = *anyBytes(100);
      append(wire, garbage);
      garbage_bytes += garbage.size();
      sent.push_back({static_cast<std::uint32_t>(sent.size()), payload});
      append(wire, bare(sent.back().sequence, payload));
    }
    const auto tail = noFrame(bareSize(128) + kHeaderSize);
    append(wire, tail);
    Reader reader{128, Framing::bare};
    RC_ASSERT(readAll(reader, wire) == sent);
    RC_ASSERT(reader.counters().frames == sent.size());
    RC_ASSERT(reader.counters().discarded_bytes + reader.unfinished() == garbage_bytes + tail.size());
  }));
}

TEST(Reader, OneDamagedByteCostsOneBareFrame) {
  ByteVector wire;
  for (std::uint32_t k = 0; k < 5; ++k) append(wire, bare(k, ByteVector(40, static_cast<std::byte>(k))));
  for (std::size_t at = 0; at < wire.size(); ++at) {
    auto damaged = wire;
    damaged[at] ^= std::byte{0x11};
    append(damaged, noFrame(bareSize(kMaxPayload)));
    Reader reader{kMaxPayload, Framing::bare};
    EXPECT_EQ(readAll(reader, damaged).size(), 4U) << at;
    // One fault for the frame, one for the tail; both may be found in one search when the last frame is hit.
    EXPECT_GE(reader.counters().bad(), 1U);
    EXPECT_LE(reader.counters().bad(), 2U);
  }
}

TEST_P(EitherReader, AcceptsTheLargestFrameOfItsSize) {
  Reader reader{300, GetParam()};
  const ByteVector payload(300, std::byte{1});
  EXPECT_EQ(readAll(reader, framed(0, payload)).size(), 1U);
  EXPECT_TRUE(readAll(reader, framed(0, ByteVector(400))).empty());
  EXPECT_EQ(reader.counters().oversize, 1U);
}

TEST_P(EitherReader, KnowsWhatWasCutOff) {
  const auto wire = framed(0, bytes({1, 2, 3}));
  for (std::size_t size = 0; size < wire.size(); ++size) {
    Reader reader{kMaxPayload, GetParam()};
    EXPECT_TRUE(readAll(reader, std::span{wire}.first(size)).empty());
    EXPECT_EQ(reader.unfinished(), size);
    reader.restart();
    EXPECT_EQ(reader.unfinished(), 0U);
    EXPECT_EQ(reader.counters().discarded_bytes, size);
    EXPECT_EQ(readAll(reader, wire).size(), 1U);
  }
}

}  // namespace
}  // namespace probebox::frame
