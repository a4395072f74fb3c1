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

std::size_t Headers::packetSize() const {
  return header.version == PacketHeader::kWithCounters ? packetBytes(header.count, more.counters, more.latches)
                                                       : packetBytes(header.count);
}

std::size_t Packet::bytes() const {
  return Headers{header, more}.packetSize();
}

Sample Packet::sample(std::size_t index) const {
  return *messages::decode<Sample>(samples.subspan(index * stride(), kSampleBytes));
}

std::int64_t Packet::count(std::size_t sample_index, std::size_t counter) const {
  frame::ByteReader reader{
      samples.subspan(sample_index * stride() + kSampleBytes + counter * kCountBytes, kCountBytes)};
  return reader.get<std::int64_t>();
}

IndexLatch Packet::latch(std::size_t index) const {
  return *messages::decode<IndexLatch>(latches.subspan(index * kLatchBytes, kLatchBytes));
}

Outcome<Headers, PacketFault> decodeHeader(std::span<const std::byte> bytes) {
  if (bytes.size() < kHeaderBytes) return PacketFault::truncated;
  Headers headers{*messages::decode<PacketHeader>(bytes.first(kHeaderBytes)), {}};
  const auto& header = headers.header;
  if (header.magic != PacketHeader::kMagic) return PacketFault::no_magic;
  const bool has_counters = header.version == PacketHeader::kWithCounters;
  if (!has_counters && header.version != PacketHeader::kVersion) return PacketFault::bad_version;
  if (header.count == 0 || header.count > kMostSamples) return PacketFault::bad_count;
  if (!has_counters) return headers;
  if (bytes.size() < kHeaderBytes + kCountersHeaderBytes) return PacketFault::truncated;
  headers.more = *messages::decode<CountersHeader>(bytes.subspan(kHeaderBytes, kCountersHeaderBytes));
  const auto& [counters, latches, reserved] = headers.more;
  if (counters == 0 || counters > kMostCounters || latches > kMostLatches) return PacketFault::bad_count;
  return headers;
}

Outcome<Packet, PacketFault> decodePacket(std::span<const std::byte> bytes) {
  TRY(const auto headers, decodeHeader(bytes));
  const std::size_t size = headers.packetSize();
  if (bytes.size() < size) return PacketFault::truncated;
  const auto checked = bytes.first(size - kCrcBytes);
  frame::ByteReader crc{bytes.subspan(checked.size(), kCrcBytes)};
  if (crc.get<std::uint32_t>() != frame::crc32c(checked)) return PacketFault::bad_crc;
  const std::size_t latch_bytes = headers.more.latches * kLatchBytes;
  const std::size_t begin = headers.more.counters == 0 ? kHeaderBytes : kHeaderBytes + kCountersHeaderBytes;
  return Packet{headers.header, headers.more, checked.subspan(begin, checked.size() - begin - latch_bytes),
                checked.last(latch_bytes)};
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

std::size_t encodePacket(PacketHeader header, std::span<const Sample> samples, const Counters& counters,
                         std::span<std::byte> into) {
  const auto& [number, counts, latches] = counters;
  const bool possible = !samples.empty() && samples.size() <= kMostSamples && number > 0 && number <= kMostCounters &&
                        latches.size() <= kMostLatches && counts.size() == samples.size() * number;
  const std::size_t size = packetBytes(samples.size(), number, latches.size());
  if (!possible || into.size() < size) return 0;
  header.version = PacketHeader::kWithCounters;
  header.count = static_cast<std::uint16_t>(samples.size());
  frame::ByteWriter writer{into};
  messages::detail::encodeFields(writer, header);
  messages::detail::encodeFields(
      writer, CountersHeader{static_cast<std::uint8_t>(number), static_cast<std::uint8_t>(latches.size()), 0});
  for (std::size_t i = 0; i < samples.size(); ++i) {
    messages::detail::encodeFields(writer, samples[i]);
    for (const auto count : counts.subspan(i * number, number)) writer.put(count);
  }
  for (const auto& latch : latches) messages::detail::encodeFields(writer, latch);
  writer.put(frame::crc32c(into.first(writer.size())));
  return size;
}

}  // namespace probebox::usb_probe
