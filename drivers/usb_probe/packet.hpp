#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>

#include "protocol/units/outcome.hpp"

// Packet of a probe receiver on its bulk IN endpoint: header, `count` samples, CRC-32C of both as u32; numbers are
// little endian. RECEIVER.md is generated from these field lists.
namespace probebox::usb_probe {

struct PacketHeader {
  static constexpr std::uint32_t kMagic = 0x3158'5250;  // "PRX1" on the wire
  static constexpr std::uint8_t kVersion = 1;

  std::uint32_t magic{kMagic};
  std::uint8_t version{kVersion};
  std::uint8_t run{};
  std::uint16_t count{};
  std::uint32_t first{};
  static constexpr void fields(auto& self, auto&& field) {
    field("magic", self.magic, "the four letters PRX1");
    field("version", self.version, "1");
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
}  // namespace status

struct Sample {
  std::array<std::int32_t, 3> channels_nm{};
  std::uint16_t status{};
  static constexpr void fields(auto& self, auto&& field) {
    field("channels_nm", self.channels_nm, "nm at unit gain, channels a, b, c");
    field("status", self.status, "bit 0: a channel is at the end of its range; other bits are 0");
  }
  friend constexpr bool operator==(const Sample&, const Sample&) = default;
};

inline constexpr std::size_t kHeaderBytes = 12;
inline constexpr std::size_t kSampleBytes = 14;
inline constexpr std::size_t kCrcBytes = 4;
inline constexpr std::size_t kMostSamples = 512;

constexpr std::size_t packetBytes(std::size_t samples) {
  return kHeaderBytes + samples * kSampleBytes + kCrcBytes;
}
inline constexpr std::size_t kMostPacketBytes = packetBytes(kMostSamples);

enum class PacketFault : std::uint8_t {
  truncated,    // shorter than its header says
  no_magic,     // it does not begin like a packet
  bad_version,  // a packet of an unknown version
  bad_count,    // no samples, or more than a packet may have
  bad_crc,
};
std::string_view nameOf(PacketFault fault);

// A checked packet. Its samples point into the caller's bytes.
struct Packet {
  PacketHeader header{};
  std::span<const std::byte> samples{};

  Sample sample(std::size_t index) const;
};

// Checks what is visible in the first kHeaderBytes.
Outcome<PacketHeader, PacketFault> decodeHeader(std::span<const std::byte> bytes);
// Checks the packet at the front of `bytes`; later bytes are ignored.
Outcome<Packet, PacketFault> decodePacket(std::span<const std::byte> bytes);

// Sets header.count. Returns the packet's size; 0 when `into` is too small, or for no samples or more than
// kMostSamples.
std::size_t encodePacket(PacketHeader header, std::span<const Sample> samples, std::span<std::byte> into);

}  // namespace probebox::usb_probe
