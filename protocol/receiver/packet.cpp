#include "protocol/receiver/packet.hpp"

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

std::size_t Headers::bytes() const {
  if (header.version == PacketHeader::kVersion) return kHeaderBytes;
  return kHeaderBytes + kCountersHeaderBytes + (header.version == PacketHeader::kWithEdges ? kEdgesHeaderBytes : 0);
}

std::size_t Headers::packetSize() const {
  return bytes() + header.count * (kSampleBytes + more.counters * kCountBytes) + more.latches * kLatchBytes +
         of_edges.edges * kEdgeBytes + kCrcBytes;
}

std::size_t Packet::bytes() const {
  return Headers{header, more, of_edges}.packetSize();
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

LineEdge Packet::edge(std::size_t index) const {
  return *messages::decode<LineEdge>(edges.subspan(index * kEdgeBytes, kEdgeBytes));
}

Outcome<Headers, PacketFault> decodeHeader(std::span<const std::byte> bytes) {
  if (bytes.size() < kHeaderBytes) return PacketFault::truncated;
  Headers headers{*messages::decode<PacketHeader>(bytes.first(kHeaderBytes)), {}, {}};
  const auto& header = headers.header;
  if (header.magic != PacketHeader::kMagic) return PacketFault::no_magic;
  if (header.version == 0 || header.version > PacketHeader::kWithEdges) return PacketFault::bad_version;
  if (header.count == 0 || header.count > kMostSamples) return PacketFault::bad_count;
  if (bytes.size() < headers.bytes()) return PacketFault::truncated;
  if (header.version == PacketHeader::kVersion) return headers;
  headers.more = *messages::decode<CountersHeader>(bytes.subspan(kHeaderBytes, kCountersHeaderBytes));
  if (header.version == PacketHeader::kWithEdges)
    headers.of_edges =
        *messages::decode<EdgesHeader>(bytes.subspan(kHeaderBytes + kCountersHeaderBytes, kEdgesHeaderBytes));
  const bool counts = headers.more.counters > 0 || header.version == PacketHeader::kWithEdges;
  if (!counts || headers.more.counters > kMostCounters || headers.more.latches > kMostLatches ||
      headers.of_edges.edges > kMostEdges)
    return PacketFault::bad_count;
  return headers;
}

Outcome<Packet, PacketFault> decodePacket(std::span<const std::byte> bytes) {
  TRY(const auto headers, decodeHeader(bytes));
  const std::size_t size = headers.packetSize();
  if (bytes.size() < size) return PacketFault::truncated;
  const auto checked = bytes.first(size - kCrcBytes);
  frame::ByteReader crc{bytes.subspan(checked.size(), kCrcBytes)};
  if (crc.get<std::uint32_t>() != frame::crc32c(checked)) return PacketFault::bad_crc;
  const auto edges = checked.last(headers.of_edges.edges * kEdgeBytes);
  const auto before_edges = checked.first(checked.size() - edges.size());
  const auto latches = before_edges.last(headers.more.latches * kLatchBytes);
  const auto samples = before_edges.first(before_edges.size() - latches.size()).subspan(headers.bytes());
  return Packet{headers.header, headers.more, headers.of_edges, samples, latches, edges};
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
                         std::span<std::byte> into, const Edges* edges) {
  const auto& [number, counts, latches] = counters;
  const bool possible = !samples.empty() && samples.size() <= kMostSamples && (number > 0 || edges != nullptr) &&
                        number <= kMostCounters && latches.size() <= kMostLatches &&
                        counts.size() == samples.size() * number &&
                        (edges == nullptr || edges->edges.size() <= kMostEdges);
  const std::size_t size = edges == nullptr ? packetBytes(samples.size(), number, latches.size())
                                            : packetBytes(samples.size(), number, latches.size(), edges->edges.size());
  if (!possible || into.size() < size) return 0;
  header.version = edges == nullptr ? PacketHeader::kWithCounters : PacketHeader::kWithEdges;
  header.count = static_cast<std::uint16_t>(samples.size());
  frame::ByteWriter writer{into};
  messages::detail::encodeFields(writer, header);
  messages::detail::encodeFields(
      writer, CountersHeader{static_cast<std::uint8_t>(number), static_cast<std::uint8_t>(latches.size()), 0});
  if (edges != nullptr)
    messages::detail::encodeFields(writer, EdgesHeader{static_cast<std::uint8_t>(edges->edges.size()), edges->levels,
                                                       edges->faults, edges->steps_a_sample});
  for (std::size_t i = 0; i < samples.size(); ++i) {
    messages::detail::encodeFields(writer, samples[i]);
    for (const auto count : counts.subspan(i * number, number)) writer.put(count);
  }
  for (const auto& latch : latches) messages::detail::encodeFields(writer, latch);
  if (edges != nullptr)
    for (const auto& edge : edges->edges) messages::detail::encodeFields(writer, edge);
  writer.put(frame::crc32c(into.first(writer.size())));
  return size;
}

}  // namespace probebox::usb_probe
