#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "protocol/receiver/packet.hpp"

namespace probebox::usb_probe {

struct PacketCounters {
  std::uint64_t packets{};       // good packets
  std::uint64_t packet_bytes{};  // bytes of good packets
  std::uint64_t bad_crc{};
  std::uint64_t bad_count{};
  std::uint64_t bad_version{};
  std::uint64_t truncated{};        // cut off by a transfer that began with another packet
  std::uint64_t discarded_bytes{};  // bytes that were not part of a good packet

  std::uint64_t bad() const { return bad_crc + bad_count + bad_version + truncated; }
};

// Finds packets in the bytes of transfers: several in one, or one across several. After damage it searches the next
// packet by its magic, even inside the range that a damaged header claims, so only affected packets are lost. Never
// allocates.
class PacketReader {
 public:
  // `bytes`: next transfer. If it begins with a header while a packet is unfinished, that packet was cut off; waiting
  // for its end would delay good data.
  void beginTransfer(std::span<const std::byte> bytes);

  // Consumes bytes up to the end of the next good packet and returns it, or consumes all of them. The packet is valid
  // until the next call.
  std::optional<Packet> next(std::span<const std::byte>& bytes);

  // Bytes of an unfinished packet.
  std::size_t unfinished() const { return end_ - begin_ - returned_; }
  const PacketCounters& counters() const { return counters_; }

  // Discards an unfinished packet (counted as discarded bytes), for a device that was opened again.
  void restart();

 private:
  void fill(std::size_t wanted, std::span<const std::byte>& bytes);
  void skipToMagic();
  void drop(PacketFault fault);
  std::span<const std::byte> held() const { return std::span{buffer_}.subspan(begin_, end_ - begin_); }

  // Room for a packet, and for the part of the next one that a damaged packet may have claimed.
  std::array<std::byte, 2 * kMostPacketBytes> buffer_{};
  std::size_t begin_{};
  std::size_t end_{};
  bool cut_{};              // the held packet was cut off: no more bytes of it will come
  std::size_t returned_{};  // bytes of the packet that was returned last, still at the beginning
  PacketCounters counters_{};
};

}  // namespace probebox::usb_probe
