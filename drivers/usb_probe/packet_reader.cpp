#include "drivers/usb_probe/packet_reader.hpp"

#include <algorithm>

namespace probebox::usb_probe {
namespace {

// The magic as it travels.
constexpr std::array<std::byte, 4> kMagic = [] {
  std::array<std::byte, 4> bytes{};
  for (std::size_t i = 0; i < bytes.size(); ++i) {
    bytes[i] = static_cast<std::byte>(PacketHeader::kMagic >> (8 * i) & 0xFFU);
  }
  return bytes;
}();

}  // namespace

void PacketReader::beginTransfer(std::span<const std::byte> bytes) {
  cut_ = unfinished() > 0 && decodeHeader(bytes).ok();
}

std::optional<Packet> PacketReader::next(std::span<const std::byte>& bytes) {
  begin_ += returned_;
  returned_ = 0;
  while (true) {
    cut_ = cut_ && begin_ < end_;
    if (!cut_) fill(kLeastPacketBytes, bytes);  // holds the headers of any version
    skipToMagic();
    auto fault = PacketFault::truncated;
    if (const auto header = decodeHeader(held()); !header) {
      fault = header.error();
    } else {
      if (!cut_) fill(header->packetSize(), bytes);
      if (const auto packet = decodePacket(held())) {
        ++counters_.packets;
        returned_ = header->packetSize();
        counters_.packet_bytes += returned_;
        return *packet;
      } else {
        fault = packet.error();
      }
    }
    const bool may_go_on = fault == PacketFault::truncated && !cut_;
    if (may_go_on && bytes.empty()) return std::nullopt;
    if (!may_go_on && begin_ < end_) drop(fault);
  }
}

// Takes from `bytes` until `wanted` are held, as far as there are any.
void PacketReader::fill(std::size_t wanted, std::span<const std::byte>& bytes) {
  const std::size_t size = end_ - begin_;
  if (size >= wanted) return;
  if (begin_ + wanted > buffer_.size()) {
    std::copy_n(buffer_.begin() + static_cast<std::ptrdiff_t>(begin_), size, buffer_.begin());
    begin_ = 0;
    end_ = size;
  }
  const std::size_t taken = std::min(wanted - size, bytes.size());
  std::copy_n(bytes.begin(), taken, buffer_.begin() + static_cast<std::ptrdiff_t>(end_));
  end_ += taken;
  bytes = bytes.subspan(taken);
}

// Leaves at the beginning what is, or may become, a magic.
void PacketReader::skipToMagic() {
  const auto from = held();
  for (std::size_t at = 0; at < from.size(); ++at) {
    const auto seen = std::min(kMagic.size(), from.size() - at);
    if (!std::equal(kMagic.begin(), kMagic.begin() + static_cast<std::ptrdiff_t>(seen),
                    from.begin() + static_cast<std::ptrdiff_t>(at))) {
      continue;
    }
    begin_ += at;
    counters_.discarded_bytes += at;
    return;
  }
  counters_.discarded_bytes += from.size();
  begin_ = end_;
}

// Discards a false start of a packet: the search continues after its first byte.
void PacketReader::drop(PacketFault fault) {
  switch (fault) {
    case PacketFault::truncated:
      ++counters_.truncated;
      break;
    case PacketFault::bad_version:
      ++counters_.bad_version;
      break;
    case PacketFault::bad_count:
      ++counters_.bad_count;
      break;
    case PacketFault::bad_crc:
      ++counters_.bad_crc;
      break;
    case PacketFault::no_magic:
      break;  // what is held begins with one
  }
  ++counters_.discarded_bytes;
  ++begin_;
}

void PacketReader::restart() {
  counters_.discarded_bytes += unfinished();
  begin_ = end_ = returned_ = 0;
  cut_ = false;
}

}  // namespace probebox::usb_probe
