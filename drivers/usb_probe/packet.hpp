#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>

#include "protocol/units/outcome.hpp"

// Packet of a probe receiver on its bulk IN endpoint: header, `count` samples, CRC-32C of both as u32; numbers are
// little endian. Version 2 adds axis counters: a CountersHeader after the header, one count a counter after each
// sample, and index latches after the samples. RECEIVER.md is generated from these field lists.
namespace probebox::usb_probe {

struct PacketHeader {
  static constexpr std::uint32_t kMagic = 0x3158'5250;  // "PRX1" on the wire
  static constexpr std::uint8_t kVersion = 1;
  static constexpr std::uint8_t kWithCounters = 2;

  std::uint32_t magic{kMagic};
  std::uint8_t version{kVersion};
  std::uint8_t run{};
  std::uint16_t count{};
  std::uint32_t first{};
  static constexpr void fields(auto& self, auto&& field) {
    field("magic", self.magic, "the four letters PRX1");
    field("version", self.version, "1; 2 with axis counters");
    field("run", self.run, "+1 each time the counter restarts; may start with any value");
    field("count", self.count, "samples in this packet, 1 to 512");
    field(
        "first", self.first,
        "counter of the first sample; the others follow without a gap. +1 for every sample taken, sent or not; wraps");
  }
  friend constexpr bool operator==(const PacketHeader&, const PacketHeader&) = default;
};

// Bits of Sample::status. Others are 0 and reserved.
namespace status {
inline constexpr std::uint16_t kClipped = 1U << 0U;  // a channel is at the end of its range
// Counter 0 has lost counts since the last sample that was sent; the next bits are those of the next counters.
// Version 2.
inline constexpr unsigned kFirstCounterFault = 8;
}  // namespace status

struct Sample {
  std::array<std::int32_t, 3> channels_nm{};
  std::uint16_t status{};
  static constexpr void fields(auto& self, auto&& field) {
    field("channels_nm", self.channels_nm, "nm at unit gain, channels a, b, c");
    field("status", self.status,
          "bit 0: a channel is at the end of its range; bit 8 + k (version 2): counter k has lost counts since the "
          "last sample that was sent, such as by a broken wire; other bits are 0");
  }
  friend constexpr bool operator==(const Sample&, const Sample&) = default;
};

// Follows the header in version 2.
struct CountersHeader {
  std::uint8_t counters{};
  std::uint8_t latches{};
  std::uint16_t reserved{};
  static constexpr void fields(auto& self, auto&& field) {
    field("counters", self.counters,
          "axis counters, 1 to 8: so many counts follow each sample; always the same number");
    field("latches", self.latches, "index latches after the samples, 0 to 16");
    field("reserved", self.reserved, "0");
  }
  friend constexpr bool operator==(const CountersHeader&, const CountersHeader&) = default;
};

// The pulse of an index (reference mark), on the sample counter.
struct IndexLatch {
  std::uint32_t sample{};
  std::uint32_t fraction{};
  std::uint8_t counter{};
  std::array<std::uint8_t, 3> reserved{};
  std::int64_t counts{};
  static constexpr void fields(auto& self, auto&& field) {
    field("sample", self.sample, "counter of the last sample that was taken before the pulse");
    field("fraction", self.fraction,
          "time from there to the pulse, in 2^-32 of a sample period; 0 when it is not measured");
    field("counter", self.counter, "whose index it is, from 0");
    field("reserved", self.reserved, "0");
    field("counts", self.counts, "its count at the pulse");
  }
  friend constexpr bool operator==(const IndexLatch&, const IndexLatch&) = default;
};

inline constexpr std::size_t kHeaderBytes = 12;
inline constexpr std::size_t kSampleBytes = 14;
inline constexpr std::size_t kCrcBytes = 4;
inline constexpr std::size_t kMostSamples = 512;
inline constexpr std::size_t kCountersHeaderBytes = 4;
inline constexpr std::size_t kCountBytes = 8;
inline constexpr std::size_t kLatchBytes = 20;
inline constexpr std::size_t kMostCounters = 8;
inline constexpr std::size_t kMostLatches = 16;

constexpr std::size_t packetBytes(std::size_t samples) {
  return kHeaderBytes + samples * kSampleBytes + kCrcBytes;
}
constexpr std::size_t packetBytes(std::size_t samples, std::size_t counters, std::size_t latches) {
  return packetBytes(samples) + kCountersHeaderBytes + samples * counters * kCountBytes + latches * kLatchBytes;
}
inline constexpr std::size_t kMostPacketBytes = packetBytes(kMostSamples, kMostCounters, kMostLatches);
// Smallest packet of any version: both headers fit into it, so a reader can wait for so many bytes.
inline constexpr std::size_t kLeastPacketBytes = packetBytes(1);

enum class PacketFault : std::uint8_t {
  truncated,    // shorter than its header says
  no_magic,     // it does not begin like a packet
  bad_version,  // a packet of an unknown version
  bad_count,    // no samples, or more than a packet may have
  bad_crc,
};
std::string_view nameOf(PacketFault fault);

// A checked packet. Its samples and latches point into the caller's bytes.
struct Packet {
  PacketHeader header{};
  CountersHeader more{};  // all 0 in version 1
  std::span<const std::byte> samples{};
  std::span<const std::byte> latches{};

  std::size_t bytes() const;
  Sample sample(std::size_t index) const;
  std::int64_t count(std::size_t sample_index, std::size_t counter) const;
  IndexLatch latch(std::size_t index) const;

 private:
  std::size_t stride() const { return kSampleBytes + more.counters * kCountBytes; }
};

// Headers of both versions.
struct Headers {
  PacketHeader header{};
  CountersHeader more{};

  std::size_t packetSize() const;
};

// Checks what is visible in the headers: kHeaderBytes, and kCountersHeaderBytes more in version 2.
Outcome<Headers, PacketFault> decodeHeader(std::span<const std::byte> bytes);
// Checks the packet at the front of `bytes`; later bytes are ignored.
Outcome<Packet, PacketFault> decodePacket(std::span<const std::byte> bytes);

// Sets header.count. Returns the packet's size; 0 when `into` is too small, or for no samples or more than
// kMostSamples.
std::size_t encodePacket(PacketHeader header, std::span<const Sample> samples, std::span<std::byte> into);

// Contents that version 2 adds.
struct Counters {
  std::size_t counters{};                // 1 to kMostCounters
  std::span<const std::int64_t> counts;  // sample by sample, all counters of each
  std::span<const IndexLatch> latches;   // at most kMostLatches
};
// The same in version 2.
std::size_t encodePacket(PacketHeader header, std::span<const Sample> samples, const Counters& counters,
                         std::span<std::byte> into);

}  // namespace probebox::usb_probe
