#include "protocol/receiver/packet.hpp"

#include <gtest/gtest.h>
#include <memory>
#include <random>
#include <rapidcheck.h>
#include <span>
#include <string>
#include <vector>

#include "drivers/usb_probe/packet_reader.hpp"
#include "host-tests/support/no_alloc.hpp"

namespace probebox::usb_probe {
namespace {

std::string hexOf(std::span<const std::byte> bytes) {
  constexpr std::string_view kDigits = "0123456789abcdef";
  std::string hex;
  for (const auto byte : bytes) {
    hex += kDigits[std::to_integer<std::size_t>(byte >> 4)];
    hex += kDigits[std::to_integer<std::size_t>(byte & std::byte{15})];
  }
  return hex;
}

using Bytes = std::vector<std::byte>;

std::vector<Sample> someSamples(std::mt19937_64& random, std::size_t count) {
  std::vector<Sample> samples(count);
  for (auto& sample : samples) {
    for (auto& nm : sample.channels_nm) nm = static_cast<std::int32_t>(random());
    sample.status = static_cast<std::uint16_t>(random());
  }
  return samples;
}

Bytes packetOf(const PacketHeader& header, const std::vector<Sample>& samples) {
  Bytes bytes(packetBytes(samples.size()));
  EXPECT_EQ(encodePacket(header, samples, bytes), bytes.size());
  return bytes;
}

// A stream of packets, each with its own number in `first`.
Bytes streamOf(std::mt19937_64& random, std::uint32_t packets, std::size_t most_samples = 20) {
  Bytes stream;
  for (std::uint32_t i = 0; i < packets; ++i) {
    const auto bytes = packetOf({.first = i}, someSamples(random, 1 + random() % most_samples));
    stream.insert(stream.end(), bytes.begin(), bytes.end());
  }
  return stream;
}

std::vector<std::uint32_t> found(PacketReader& reader, std::span<const std::byte> bytes, std::size_t piece = 0) {
  std::vector<std::uint32_t> firsts;
  while (!bytes.empty()) {
    auto part = bytes.first(piece == 0 ? bytes.size() : std::min(piece, bytes.size()));
    bytes = bytes.subspan(part.size());
    while (const auto packet = reader.next(part)) firsts.push_back(packet->header.first);
    EXPECT_TRUE(part.empty());
  }
  return firsts;
}

// Frozen: receivers in the field send these bytes.
TEST(Packet, IsTheseBytes) {
  const std::vector<Sample> samples{{{1, -2, 0x01020304}, status::kClipped}, {{-1'000'000, 0, 7}, 0}};
  const auto bytes = packetOf({.run = 9, .first = 0xA0B0C0D0}, samples);
  const auto hex = hexOf(bytes);
  EXPECT_EQ(hex.substr(0, hex.size() - 8),
            "5052583101090200d0c0b0a0"
            "01000000feffffff040302010100"
            "c0bdf0ff00000000070000000000");
  EXPECT_EQ(hex.substr(hex.size() - 8), "06d749d5");
}

TEST(Packet, RoundTrips) {
  EXPECT_TRUE(rc::check("decode(encode(x)) == x", [] {
    std::mt19937_64 random{*rc::gen::arbitrary<std::uint64_t>()};
    const PacketHeader header{.run = static_cast<std::uint8_t>(random()),
                              .first = static_cast<std::uint32_t>(random())};
    const auto samples = someSamples(random, *rc::gen::inRange<std::size_t>(1, kMostSamples + 1));
    auto bytes = packetOf(header, samples);
    bytes.resize(bytes.size() + random() % 20, std::byte{0x55});  // what follows is another packet's
    const auto packet = decodePacket(bytes);
    RC_ASSERT(packet.ok());
    RC_ASSERT(packet->header.run == header.run);
    RC_ASSERT(packet->header.first == header.first);
    RC_ASSERT(packet->header.count == samples.size());
    for (std::size_t i = 0; i < samples.size(); ++i) RC_ASSERT(packet->sample(i) == samples[i]);
  }));
}

TEST(Packet, NamesWhatIsWrongWithIt) {
  std::mt19937_64 random{1};
  const auto good = packetOf({}, someSamples(random, 3));
  for (std::size_t size = 0; size < good.size(); ++size) {
    EXPECT_EQ(decodePacket(std::span{good}.first(size)).error(), PacketFault::truncated) << size;
  }
  const auto spoilt = [&](std::size_t at, int value) {
    auto bytes = good;
    bytes[at] = static_cast<std::byte>(value);
    return decodePacket(bytes).error();
  };
  EXPECT_EQ(spoilt(0, 'p'), PacketFault::no_magic);
  EXPECT_EQ(spoilt(4, 4), PacketFault::bad_version);
  EXPECT_EQ(spoilt(4, 0), PacketFault::bad_version);
  EXPECT_EQ(spoilt(6, 0), PacketFault::bad_count);
  EXPECT_EQ(spoilt(7, 3), PacketFault::bad_count);
  EXPECT_EQ(nameOf(PacketFault::bad_version), "unknown version");
}

TEST(Packet, WithOneWrongBitAnywhereIsNotTaken) {
  std::mt19937_64 random{2};
  const auto good = packetOf({.run = 3, .first = 77}, someSamples(random, 5));
  for (std::size_t bit = 0; bit < 8 * good.size(); ++bit) {
    auto bytes = good;
    bytes[bit / 8] ^= static_cast<std::byte>(1U << (bit % 8));
    EXPECT_FALSE(decodePacket(bytes)) << bit;
  }
}

TEST(Packet, HasOneTo512SamplesAndFitsIntoItsRoom) {
  std::mt19937_64 random{3};
  Bytes room(packetBytes(kMostSamples + 1));
  EXPECT_EQ(encodePacket({}, {}, room), 0U);
  EXPECT_EQ(encodePacket({}, someSamples(random, kMostSamples + 1), room), 0U);
  EXPECT_EQ(encodePacket({}, someSamples(random, kMostSamples), room), packetBytes(kMostSamples));
  EXPECT_EQ(encodePacket({}, someSamples(random, 4), std::span{room}.first(packetBytes(4) - 1)), 0U);
}

// A packet of version 2 with all that it may have.
struct Axes {
  std::vector<std::int64_t> counts;
  std::vector<IndexLatch> latches;
};

Axes someAxes(std::mt19937_64& random, std::size_t samples, std::size_t counters) {
  Axes axes;
  for (std::size_t i = 0; i < samples * counters; ++i) axes.counts.push_back(static_cast<std::int64_t>(random()));
  for (std::size_t i = random() % (kMostLatches + 1); i > 0; --i)
    axes.latches.push_back({.sample = static_cast<std::uint32_t>(random()),
                            .fraction = static_cast<std::uint32_t>(random()),
                            .counter = static_cast<std::uint8_t>(random() % counters),
                            .counts = static_cast<std::int64_t>(random())});
  return axes;
}

Bytes packetOf(const PacketHeader& header, const std::vector<Sample>& samples, std::size_t counters, const Axes& axes) {
  Bytes bytes(packetBytes(samples.size(), counters, axes.latches.size()));
  EXPECT_EQ(encodePacket(header, samples, {counters, axes.counts, axes.latches}, bytes), bytes.size());
  return bytes;
}

// Frozen: receivers in the field send these bytes.
TEST(PacketWithCounters, IsTheseBytes) {
  const Axes axes{{-2, 0x0102030405060708}, {{.sample = 5, .fraction = 0x80000000, .counter = 1, .counts = 7}}};
  const auto bytes = packetOf({.run = 9, .first = 5}, {{{1, 2, 3}, status::kClipped}}, 2, axes);
  const auto hex = hexOf(bytes);
  EXPECT_EQ(hex.substr(0, hex.size() - 8),
            "505258310209010005000000"
            "02010000"
            "0100000002000000030000000100"
            "feffffffffffffff0807060504030201"
            "0500000000000080010000000700000000000000");
}

TEST(PacketWithCounters, RoundTrips) {
  EXPECT_TRUE(rc::check("decode(encode(x)) == x", [] {
    std::mt19937_64 random{*rc::gen::arbitrary<std::uint64_t>()};
    const auto samples = someSamples(random, *rc::gen::inRange<std::size_t>(1, kMostSamples + 1));
    const auto counters = *rc::gen::inRange<std::size_t>(1, kMostCounters + 1);
    const auto axes = someAxes(random, samples.size(), counters);
    auto bytes = packetOf({.run = 4, .first = 99}, samples, counters, axes);
    bytes.resize(bytes.size() + random() % 20, std::byte{0x55});
    const auto packet = decodePacket(bytes);
    RC_ASSERT(packet.ok());
    RC_ASSERT(packet->more.counters == counters);
    RC_ASSERT(packet->more.latches == axes.latches.size());
    for (std::size_t i = 0; i < samples.size(); ++i) {
      RC_ASSERT(packet->sample(i) == samples[i]);
      for (std::size_t k = 0; k < counters; ++k) RC_ASSERT(packet->count(i, k) == axes.counts[i * counters + k]);
    }
    for (std::size_t i = 0; i < axes.latches.size(); ++i) RC_ASSERT(packet->latch(i) == axes.latches[i]);
  }));
}

TEST(PacketWithCounters, NamesWhatIsWrongWithIt) {
  std::mt19937_64 random{11};
  const auto good = packetOf({}, someSamples(random, 3), 2, someAxes(random, 3, 2));
  for (std::size_t size = 0; size < good.size(); ++size)
    EXPECT_EQ(decodePacket(std::span{good}.first(size)).error(), PacketFault::truncated) << size;
  for (std::size_t bit = 0; bit < 8 * good.size(); ++bit) {
    auto bytes = good;
    bytes[bit / 8] ^= static_cast<std::byte>(1U << (bit % 8));
    EXPECT_FALSE(decodePacket(bytes)) << bit;
  }
  const auto spoilt = [&](std::size_t at, int value) {
    auto bytes = good;
    bytes[at] = static_cast<std::byte>(value);
    return decodePacket(bytes).error();
  };
  EXPECT_EQ(spoilt(12, 0), PacketFault::bad_count);
  EXPECT_EQ(spoilt(12, 9), PacketFault::bad_count);
  EXPECT_EQ(spoilt(13, 17), PacketFault::bad_count);
  Bytes room(kMostPacketBytes);
  const auto samples = someSamples(random, 2);
  const std::vector<std::int64_t> counts(4);
  EXPECT_EQ(encodePacket({}, samples, {0, {}, {}}, room), 0U);
  EXPECT_EQ(encodePacket({}, samples, {9, counts, {}}, room), 0U);
  EXPECT_EQ(encodePacket({}, samples, {3, counts, {}}, room), 0U) << "three counts a sample are six";
  const std::vector<IndexLatch> latches(kMostLatches + 1);
  EXPECT_EQ(encodePacket({}, samples, {2, counts, latches}, room), 0U);
}

std::vector<LineEdge> someEdges(std::mt19937_64& random) {
  std::vector<LineEdge> edges(random() % (kMostEdges + 1));
  for (auto& edge : edges)
    edge = {.sample = static_cast<std::uint32_t>(random()),
            .fraction = static_cast<std::uint32_t>(random()),
            .line = static_cast<std::uint8_t>(random() % kReceiverLines),
            .level = static_cast<std::uint8_t>(random() % 2),
            .sequence = static_cast<std::uint16_t>(random()),
            .lost = static_cast<std::uint8_t>(random())};
  return edges;
}

// Frozen: receivers in the field send these bytes.
TEST(PacketWithEdges, IsTheseBytes) {
  const std::vector<std::int64_t> counts{-2};
  const std::vector<IndexLatch> latches{{.sample = 5, .fraction = 0x80000000, .counter = 0, .counts = 7}};
  const std::vector<LineEdge> edges{
      {.sample = 4, .fraction = 0x40000000, .line = 2, .level = 1, .sequence = 0x0102, .lost = 3}};
  const Edges more{
      .steps_a_sample = 10422, .faults = bitOf(ReceiverFault::converter_silent), .edges = edges, .levels = 4};
  Bytes bytes(packetBytes(1, 1, 1, 1));
  const std::vector<Sample> samples{{{1, 2, 3}, status::kClipped}};
  EXPECT_EQ(encodePacket({.run = 9, .first = 5}, samples, {1, counts, latches}, bytes, &more), bytes.size());
  const auto hex = hexOf(bytes);
  EXPECT_EQ(hex.substr(0, hex.size() - 8),
            "505258310309010005000000"
            "01010000"
            "01040400b6280000"
            "0100000002000000030000000100"
            "feffffffffffffff"
            "0500000000000080000000000700000000000000"
            "04000000000000400201020103");
}

TEST(PacketWithEdges, RoundTripsAndIsNotTakenWithAWrongBit) {
  EXPECT_TRUE(rc::check("decode(encode(x)) == x", [] {
    std::mt19937_64 random{*rc::gen::arbitrary<std::uint64_t>()};
    const auto samples = someSamples(random, *rc::gen::inRange<std::size_t>(1, 100));
    const auto counters = *rc::gen::inRange<std::size_t>(0, kMostCounters + 1);
    const auto axes = counters == 0 ? Axes{} : someAxes(random, samples.size(), counters);
    const auto edges = someEdges(random);
    const Edges more{static_cast<std::uint32_t>(random()), static_cast<std::uint16_t>(random()), edges,
                     static_cast<std::uint8_t>(random() % 32)};
    Bytes bytes(packetBytes(samples.size(), counters, axes.latches.size(), edges.size()));
    RC_ASSERT(encodePacket({.first = 7}, samples, {counters, axes.counts, axes.latches}, bytes, &more) == bytes.size());
    const auto packet = decodePacket(bytes);
    RC_ASSERT(packet.ok());
    RC_ASSERT(packet->of_edges.steps_a_sample == more.steps_a_sample);
    RC_ASSERT(packet->of_edges.faults == more.faults);
    RC_ASSERT(packet->of_edges.levels == more.levels);
    for (std::size_t i = 0; i < samples.size(); ++i) RC_ASSERT(packet->sample(i) == samples[i]);
    for (std::size_t i = 0; i < axes.counts.size(); ++i)
      RC_ASSERT(packet->count(i / counters, i % counters) == axes.counts[i]);
    for (std::size_t i = 0; i < axes.latches.size(); ++i) RC_ASSERT(packet->latch(i) == axes.latches[i]);
    RC_ASSERT(packet->of_edges.edges == edges.size());
    for (std::size_t i = 0; i < edges.size(); ++i) RC_ASSERT(packet->edge(i) == edges[i]);
    bytes[random() % bytes.size()] ^= static_cast<std::byte>(1U << (random() % 8));
    RC_ASSERT(!decodePacket(bytes).ok());
  }));
  const std::vector<LineEdge> too_many(kMostEdges + 1);
  const Edges more{1, 0, too_many};
  Bytes room(kMostPacketBytes);
  EXPECT_EQ(encodePacket({}, std::vector<Sample>(1), {0, {}, {}}, room, &more), 0U);
}

TEST(PacketReader, FindsPacketsOfAllVersionsHoweverTheyAreCut) {
  std::mt19937_64 random{12};
  Bytes stream;
  for (std::uint32_t i = 0; i < 60; ++i) {
    const auto samples = someSamples(random, 1 + random() % 20);
    auto bytes = i % 3 == 0 ? packetOf({.first = i}, samples)
                            : packetOf({.first = i}, samples, 3, someAxes(random, samples.size(), 3));
    if (i % 4 == 0) {
      const auto edges = someEdges(random);
      const Edges more{1, 0, edges};
      bytes.resize(kMostPacketBytes);
      bytes.resize(encodePacket({.first = i}, samples, {0, {}, {}}, bytes, &more));
    }
    stream.insert(stream.end(), bytes.begin(), bytes.end());
  }
  for (const std::size_t piece : {1U, 3U, 11U, 13U, 15U, 17U, 64U, 512U, 1000U, 0U}) {
    PacketReader reader;
    const auto firsts = found(reader, stream, piece);
    ASSERT_EQ(firsts.size(), 60U) << piece;
    for (std::uint32_t i = 0; i < 60; ++i) EXPECT_EQ(firsts[i], i);
    EXPECT_EQ(reader.counters().discarded_bytes, 0U);
  }
}

TEST(PacketReader, FindsPacketsHoweverTheyAreCut) {
  std::mt19937_64 random{4};
  const auto stream = streamOf(random, 60);
  for (const std::size_t piece : {1U, 3U, 11U, 12U, 13U, 64U, 512U, 1000U, 0U}) {
    PacketReader reader;
    const auto firsts = found(reader, stream, piece);
    ASSERT_EQ(firsts.size(), 60U) << piece;
    for (std::uint32_t i = 0; i < 60; ++i) EXPECT_EQ(firsts[i], i);
    EXPECT_EQ(reader.counters().discarded_bytes, 0U);
    EXPECT_EQ(reader.counters().packets, 60U);
    EXPECT_EQ(reader.unfinished(), 0U);
  }
}

// Damage costs the packets that it touches; everything is either in a packet or counted as discarded.
TEST(PacketReader, LosesOnlyThePacketsThatAreTouched) {
  EXPECT_TRUE(rc::check("every packet without a wrong byte is found", [] {
    std::mt19937_64 random{*rc::gen::arbitrary<std::uint64_t>()};
    std::vector<Bytes> packets;
    for (std::uint32_t i = 0; i < 20; ++i)
      packets.push_back(packetOf({.first = i}, someSamples(random, 1 + random() % 30)));
    Bytes stream;
    std::vector<Bytes::difference_type> begins;
    for (auto bytes : packets) {
      begins.push_back(std::ssize(stream));
      switch (random() % 6) {
        case 0:  // a wrong byte
          bytes[random() % bytes.size()] ^= static_cast<std::byte>(1 + random() % 255);
          break;
        case 1:  // cut off
          bytes.resize(random() % bytes.size());
          break;
        case 2:  // a byte too many
          bytes.insert(bytes.begin() + static_cast<std::ptrdiff_t>(random() % bytes.size()),
                       static_cast<std::byte>(random()));
          break;
        default:
          break;
      }
      stream.insert(stream.end(), bytes.begin(), bytes.end());
    }
    // What a damaged header had claimed must not hide the packets inside.
    const Bytes quiet(2 * kMostPacketBytes);
    stream.insert(stream.end(), quiet.begin(), quiet.end());
    // Chance may give the very byte that was there, or was cut off: what counts is whether the whole packet stands
    // there.
    std::vector<std::uint32_t> untouched;
    for (std::uint32_t i = 0; i < 20; ++i) {
      const auto from = stream.begin() + begins[i];
      const auto standsAt = [&](auto place) { return std::equal(packets[i].begin(), packets[i].end(), place); };
      if (standsAt(from) || standsAt(from + 1)) untouched.push_back(i);
    }
    PacketReader reader;
    auto firsts = found(reader, stream, 1 + random() % 700);
    RC_ASSERT(firsts == untouched);
    RC_ASSERT(reader.counters().packets == untouched.size());
  }));
}

TEST(PacketReader, AccountsForEveryByte) {
  std::mt19937_64 random{5};
  PacketReader reader;
  std::uint64_t in_packets = 0;
  std::uint64_t fed = 0;
  for (int round = 0; round < 300; ++round) {
    Bytes bytes = random() % 2 == 0 ? streamOf(random, 3) : Bytes(random() % 400);
    for (auto& byte : bytes) {
      if (random() % 200 == 0) byte = static_cast<std::byte>(random() % 4 == 0 ? 0x50U : random());
    }
    fed += bytes.size();
    std::span<const std::byte> left{bytes};
    while (const auto packet = reader.next(left)) in_packets += packetBytes(packet->header.count);
  }
  EXPECT_EQ(fed, in_packets + reader.counters().discarded_bytes + reader.unfinished());
  EXPECT_GT(reader.counters().packets, 200U);
  EXPECT_GT(reader.counters().bad(), 20U);
}

TEST(PacketReader, CountsEachFaultByItsName) {
  std::mt19937_64 random{6};
  auto wrong_crc = packetOf({}, someSamples(random, 2));
  wrong_crc[20] ^= std::byte{1};
  auto version = packetOf({}, someSamples(random, 2));
  version[4] = std::byte{7};
  auto count = packetOf({}, someSamples(random, 2));
  count[6] = std::byte{0};
  PacketReader reader;
  for (const auto& bytes : {wrong_crc, version, count, packetOf({.first = 42}, someSamples(random, 2))}) {
    std::span<const std::byte> left{bytes};
    const auto packet = reader.next(left);
    if (packet) {
      EXPECT_EQ(packet->header.first, 42U);
    }
  }
  EXPECT_EQ(reader.counters().bad_crc, 1U);
  EXPECT_EQ(reader.counters().bad_version, 1U);
  EXPECT_EQ(reader.counters().bad_count, 1U);
  EXPECT_EQ(reader.counters().packets, 1U);
}

TEST(PacketReader, RestartForgetsWhatWasBegun) {
  std::mt19937_64 random{7};
  const auto bytes = packetOf({.first = 5}, someSamples(random, 10));
  PacketReader reader;
  EXPECT_TRUE(found(reader, std::span{bytes}.first(50)).empty());
  EXPECT_EQ(reader.unfinished(), 50U);
  reader.restart();
  EXPECT_EQ(reader.counters().discarded_bytes, 50U);
  EXPECT_EQ(found(reader, bytes), std::vector<std::uint32_t>{5});
}

TEST(PacketReader, NeverAllocates) {
  std::mt19937_64 random{8};
  auto stream = streamOf(random, 50, kMostSamples);
  for (int i = 0; i < 20; ++i) stream[random() % stream.size()] ^= std::byte{0x10};
  const auto reader = std::make_unique<PacketReader>();
  std::uint64_t packets = 0;
  const support::NoAlloc guard;
  std::span<const std::byte> left{stream};
  while (!left.empty()) {
    auto part = left.first(std::min<std::size_t>(512, left.size()));
    left = left.subspan(part.size());
    while (reader->next(part)) ++packets;
  }
  EXPECT_EQ(guard.allocations(), 0U);
  EXPECT_GT(packets, 20U);
}

}  // namespace
}  // namespace probebox::usb_probe
