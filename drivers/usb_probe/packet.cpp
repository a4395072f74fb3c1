#include "drivers/usb_probe/packet.hpp"

#include "protocol/frame/bytes.hpp"
#include "protocol/frame/crc32c.hpp"
#include "protocol/messages/fields.hpp"

namespace probebox::usb_probe {

std::string_view nameOf(PacketFault fault) {
  switch (fault) {
    case PacketFault::truncated:
      return "truncated";
    case PacketFault::no_magic:
      return "no magic";
    case PacketFault::bad_version:
      return "unknown version";
    case PacketFault::bad_count:
      return "impossible count";
    case PacketFault::bad_crc:
      return "wrong CRC";
  }
  return "unknown";
}

Sample Packet::sample(std::size_t index) const {
  return *messages::decode<Sample>(samples.subspan(index * kSampleBytes, kSampleBytes));
}

Outcome<PacketHeader, PacketFault> decodeHeader(std::span<const std::byte> bytes) {
  if (bytes.size() < kHeaderBytes) return PacketFault::truncated;
  const PacketHeader header = *messages::decode<PacketHeader>(bytes.first(kHeaderBytes));
  if (header.magic != PacketHeader::kMagic) return PacketFault::no_magic;
  if (header.version != PacketHeader::kVersion) return PacketFault::bad_version;
  if (header.count == 0 || header.count > kMostSamples) return PacketFault::bad_count;
  return header;
}

Outcome<Packet, PacketFault> decodePacket(std::span<const std::byte> bytes) {
  const auto header = decodeHeader(bytes);
  if (!header) return header.error();
  const std::size_t size = packetBytes(header->count);
  if (bytes.size() < size) return PacketFault::truncated;
  frame::ByteReader crc{bytes.subspan(size - kCrcBytes, kCrcBytes)};
  if (crc.get<std::uint32_t>() != frame::crc32c(bytes.first(size - kCrcBytes))) return PacketFault::bad_crc;
  return Packet{*header, bytes.subspan(kHeaderBytes, header->count * kSampleBytes)};
}

std::size_t encodePacket(PacketHeader header, std::span<const Sample> samples, std::span<std::byte> into) {
  const std::size_t size = packetBytes(samples.size());
  if (samples.empty() || samples.size() > kMostSamples || into.size() < size) return 0;
  header.count = static_cast<std::uint16_t>(samples.size());
  frame::ByteWriter writer{into};
  messages::detail::encodeFields(writer, header);
  for (const auto& sample : samples) messages::detail::encodeFields(writer, sample);
  writer.put(frame::crc32c(into.first(writer.size())));
  return size;
}

}  // namespace probebox::usb_probe
