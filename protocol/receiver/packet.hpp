#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>

#include "protocol/units/outcome.hpp"

// Packet of a probe receiver on its bulk IN endpoint: header, `count` samples, CRC-32C of both as u32; numbers are
// little endian. Version 2 adds axis counters: a CountersHeader after the header, one count a counter after each
// sample, and index latches after the samples. Version 3 adds edges of lines: an EdgesHeader after the CountersHeader,
// and the edges after the latches. RECEIVER.md is generated from these field lists. The program of the front end
// (firmware/front_end) is compiled from the same ones: nothing here allocates.
namespace probebox::usb_probe {

struct PacketHeader {
  static constexpr std::uint32_t kMagic = 0x3158'5250;  // "PRX1" on the wire
  static constexpr std::uint8_t kVersion = 1;
  static constexpr std::uint8_t kWithCounters = 2;
  static constexpr std::uint8_t kWithEdges = 3;

  std::uint32_t magic{kMagic};
  std::uint8_t version{kVersion};
  std::uint8_t run{};
  std::uint16_t count{};
  std::uint32_t first{};
  static constexpr void fields(auto& self, auto&& field) {
    field("magic", self.magic, "the four letters PRX1");
    field("version", self.version, "1; 2 with axis counters; 3 with edges of lines as well");
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
// Since version 2.
inline constexpr unsigned kFirstCounterFault = 8;
}  // namespace status

struct Sample {
  std::array<std::int32_t, 3> channels_nm{};
  std::uint16_t status{};
  static constexpr void fields(auto& self, auto&& field) {
    field("channels_nm", self.channels_nm, "nm at unit gain, channels a, b, c");
    field("status", self.status,
          "bit 0: a channel is at the end of its range; bit 8 + k (from version 2 on): counter k has lost counts since "
          "the "
          "last sample that was sent, such as by a broken wire; other bits are 0");
  }
  friend constexpr bool operator==(const Sample&, const Sample&) = default;
};

// Follows the header from version 2 on.
struct CountersHeader {
  std::uint8_t counters{};
  std::uint8_t latches{};
  std::uint16_t reserved{};
  static constexpr void fields(auto& self, auto&& field) {
    field("counters", self.counters,
          "axis counters, 1 to 8 (version 3: 0 to 8): so many counts follow each sample; always the same number");
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

// Follows the CountersHeader in version 3.
struct EdgesHeader {
  std::uint8_t edges{};
  std::uint8_t levels{};
  std::uint16_t faults{};
  std::uint32_t steps_a_sample{};
  static constexpr void fields(auto& self, auto&& field) {
    field("edges", self.edges, "edges of lines after the index latches, 0 to 32");
    field("levels", self.levels, "levels of the lines after these edges, bit 0 sync and so on as in `line`");
    field("faults", self.faults,
          "what is wrong with the receiver now, or was since its last packet: see the faults below");
    field("steps_a_sample", self.steps_a_sample,
          "steps of the receiver's counter in a sample period: how finely the times of edges and pulses are known");
  }
  friend constexpr bool operator==(const EdgesHeader&, const EdgesHeader&) = default;
};

// Lines of an edge.
enum class ReceiverLine : std::uint8_t { sync = 0, trigger_1 = 1, trigger_2 = 2, inhibit = 3, loop_back = 4 };
inline constexpr std::size_t kReceiverLines = 5;

// One edge of a line, on the sample counter.
struct LineEdge {
  std::uint32_t sample{};
  std::uint32_t fraction{};
  std::uint8_t line{};
  std::uint8_t level{};
  std::uint16_t sequence{};
  std::uint8_t lost{};
  static constexpr void fields(auto& self, auto&& field) {
    field("sample", self.sample, "counter of the last sample that was taken before the edge");
    field("fraction", self.fraction, "time from there to the edge, in 2^-32 of a sample period");
    field("line", self.line, "0 sync, 1 first trigger, 2 second trigger, 3 inhibit, 4 loop-back");
    field("level", self.level, "the level that the edge leads to: 0 low, 1 high");
    field("sequence", self.sequence, "counts the edges of this line, sent or not; wraps");
    field("lost", self.lost, "edges of this line lost just before this one, 255 for more");
  }
  friend constexpr bool operator==(const LineEdge&, const LineEdge&) = default;
};

// Bits of EdgesHeader::faults.
enum class ReceiverFault : std::uint8_t {
  watchdog = 0,
  brown_out = 1,
  converter_silent = 2,
  samples_dropped = 3,
  edges_lost = 4,
  latches_lost = 5,
  counter_overrun = 6,
  deflections_late = 7,
  wires_1 = 8,
  wires_2 = 9,
  wires_3 = 10,
  wires_4 = 11,
};
struct ReceiverFaultName {
  ReceiverFault fault;
  std::string_view name;
  std::string_view meaning;
};
inline constexpr std::array<ReceiverFaultName, 12> kReceiverFaults{{
    {ReceiverFault::watchdog, "watchdog", "its program had stopped, and the watchdog started it again"},
    {ReceiverFault::brown_out, "brown-out", "its supply had failed for a moment, and it started again"},
    {ReceiverFault::converter_silent, "converter-silent", "its converter does not answer: deflections are not valid"},
    {ReceiverFault::samples_dropped, "samples-dropped", "samples were dropped because nobody read them"},
    {ReceiverFault::edges_lost, "edges-lost", "edges of lines were lost: there were more than it can hold"},
    {ReceiverFault::latches_lost, "latches-lost", "index pulses were lost: there were more than it can hold"},
    {ReceiverFault::counter_overrun, "counter-overrun", "an axis moved faster than its counter holds"},
    {ReceiverFault::deflections_late, "deflections-late", "deflections were not read in time: they are not valid"},
    {ReceiverFault::wires_1, "wires-of-counter-0", "a wire of counter 0 is broken, or its encoder is not connected"},
    {ReceiverFault::wires_2, "wires-of-counter-1", "a wire of counter 1 is broken, or its encoder is not connected"},
    {ReceiverFault::wires_3, "wires-of-counter-2", "a wire of counter 2 is broken, or its encoder is not connected"},
    {ReceiverFault::wires_4, "wires-of-counter-3", "a wire of counter 3 is broken, or its encoder is not connected"},
}};
constexpr std::uint16_t bitOf(ReceiverFault fault) {
  return static_cast<std::uint16_t>(1U << static_cast<unsigned>(fault));
}

inline constexpr std::size_t kHeaderBytes = 12;
inline constexpr std::size_t kSampleBytes = 14;
inline constexpr std::size_t kCrcBytes = 4;
inline constexpr std::size_t kMostSamples = 512;
inline constexpr std::size_t kCountersHeaderBytes = 4;
inline constexpr std::size_t kCountBytes = 8;
inline constexpr std::size_t kLatchBytes = 20;
inline constexpr std::size_t kMostCounters = 8;
inline constexpr std::size_t kMostLatches = 16;
inline constexpr std::size_t kEdgesHeaderBytes = 8;
inline constexpr std::size_t kEdgeBytes = 13;
inline constexpr std::size_t kMostEdges = 32;

constexpr std::size_t packetBytes(std::size_t samples) {
  return kHeaderBytes + samples * kSampleBytes + kCrcBytes;
}
constexpr std::size_t packetBytes(std::size_t samples, std::size_t counters, std::size_t latches) {
  return packetBytes(samples) + kCountersHeaderBytes + samples * counters * kCountBytes + latches * kLatchBytes;
}
constexpr std::size_t packetBytes(std::size_t samples, std::size_t counters, std::size_t latches, std::size_t edges) {
  return packetBytes(samples, counters, latches) + kEdgesHeaderBytes + edges * kEdgeBytes;
}
inline constexpr std::size_t kMostPacketBytes = packetBytes(kMostSamples, kMostCounters, kMostLatches, kMostEdges);
// Smallest packet of any version: all headers fit into it, so a reader can wait for so many bytes.
inline constexpr std::size_t kLeastPacketBytes = packetBytes(1);

enum class PacketFault : std::uint8_t {
  truncated,    // shorter than its header says
  no_magic,     // it does not begin like a packet
  bad_version,  // a packet of an unknown version
  bad_count,    // no samples, or more than a packet may have
  bad_crc,
};
std::string_view nameOf(PacketFault fault);

// A checked packet. Its samples, latches and edges point into the caller's bytes.
struct Packet {
  PacketHeader header{};
  CountersHeader more{};   // all 0 in version 1
  EdgesHeader of_edges{};  // all 0 before version 3
  std::span<const std::byte> samples{};
  std::span<const std::byte> latches{};
  std::span<const std::byte> edges{};

  std::size_t bytes() const;
  Sample sample(std::size_t index) const;
  std::int64_t count(std::size_t sample_index, std::size_t counter) const;
  IndexLatch latch(std::size_t index) const;
  LineEdge edge(std::size_t index) const;

 private:
  std::size_t stride() const { return kSampleBytes + more.counters * kCountBytes; }
};

// Headers of all versions.
struct Headers {
  PacketHeader header{};
  CountersHeader more{};
  EdgesHeader of_edges{};

  std::size_t bytes() const;  // of the headers themselves
  std::size_t packetSize() const;
};

// Checks what is visible in the headers: kHeaderBytes, and kCountersHeaderBytes more from version 2 on,
// kEdgesHeaderBytes more in version 3.
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
// Contents that version 3 adds.
struct Edges {
  std::uint32_t steps_a_sample{};
  std::uint16_t faults{};
  std::span<const LineEdge> edges;  // at most kMostEdges
  std::uint8_t levels{};
};
// The same in version 2; with `edges` in version 3, which may have no counters.
std::size_t encodePacket(PacketHeader header, std::span<const Sample> samples, const Counters& counters,
                         std::span<std::byte> into, const Edges* edges = nullptr);

}  // namespace probebox::usb_probe
