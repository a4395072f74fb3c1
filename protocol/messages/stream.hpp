#pragma once
#include <cstdint>

#include "protocol/messages/fields.hpp"
#include "protocol/messages/types.hpp"

// What travels beside SAMPLES (whose payload is a block of protocol/codec). Since protocol 1.0.
namespace probebox::messages {

// Box to host: stands exactly where samples are missing.
struct Gap {
  static constexpr MessageType kType = MessageType::gap;
  SampleIndex first{};
  std::uint64_t count{};
  GapReason reason{};
  static constexpr void fields(auto& self, auto&& field) {
    field("first", self.first, "index of the first missing sample");
    field("count", self.count, "how many are missing");
    field("reason", self.reason,
          "0 clock, 1 probe, 2 encoders (lost at the source); 3 queue full, 4 ring overrun, 5 resume too old (lost in "
          "the box)");
  }
};

// What reached the box's side of a link from the host.
struct LinkCounters {
  std::uint64_t frames{};
  std::uint64_t bad_crc{};
  std::uint64_t bad_cobs{};
  std::uint64_t bad_length{};
  std::uint64_t oversize{};
  std::uint64_t discarded_bytes{};
  std::uint64_t unexpected{};
  static constexpr void fields(auto& self, auto&& field) {
    field("frames", self.frames, "good frames from the host");
    field("bad_crc", self.bad_crc, "frames with a wrong CRC");
    field("bad_cobs", self.bad_cobs, "frames that are no COBS");
    field("bad_length", self.bad_length, "frames whose length disagrees");
    field("oversize", self.oversize, "frames beyond what the box takes");
    field("discarded_bytes", self.discarded_bytes, "bytes of everything that was no good frame");
    field("unexpected", self.unexpected, "good frames of unknown type, or that made no sense in their place");
  }
};

// The fate of every edge of the master clock.
struct EdgeCounters {
  std::uint64_t accepted{};
  std::uint64_t missing{};
  std::uint64_t doubled{};
  std::uint64_t spurious{};
  std::uint64_t lost{};
  std::uint64_t unlocked{};
  static constexpr void fields(auto& self, auto&& field) {
    field("accepted", self.accepted, "edges that became a tick");
    field("missing", self.missing, "ticks without an edge");
    field("doubled", self.doubled, "second edges of one tick");
    field("spurious", self.spurious, "edges that fit no tick");
    field("lost", self.lost, "edges that the kernel dropped, by its line sequence number");
    field("unlocked", self.unlocked, "edges that came while no clock could give them a tick");
  }
};

// Box to host, 10 a second on serial and TCP. The ledger is that of this link's stream, as of this place in the order
// of frames: produced = sent_samples + lost_at_source + lost_in_queue = position - start, exactly.
struct Heartbeat {
  static constexpr MessageType kType = MessageType::heartbeat;
  std::uint64_t uptime_ms{};
  bool streaming{};
  std::uint32_t stream_number{};
  SampleIndex start{};
  SampleIndex position{};
  std::uint64_t produced{};
  std::uint64_t lost_at_source{};
  std::uint64_t lost_in_queue{};
  std::uint64_t sent_samples{};
  std::uint64_t queued_samples{};
  std::uint64_t sent_bytes{};
  std::uint32_t queue_high_water{};
  LinkCounters link{};
  ClockState clock_state{};
  std::uint32_t clock_sigma_ns{};
  std::uint64_t deadline_misses{};
  EdgeCounters edges{};
  static constexpr void fields(auto& self, auto&& field) {
    field("uptime_ms", self.uptime_ms, "ms since the box started");
    field("streaming", self.streaming, "1 between START and STOP");
    field("stream_number", self.stream_number, "+1 every START since HELLO, 0 before the first: whose ledger this is");
    field("start", self.start, "first sample of this link's stream");
    field("position", self.position, "next sample of this link's stream");
    field("produced", self.produced, "samples of the stream so far, sent or declared lost");
    field("lost_at_source", self.lost_at_source, "samples in GAP frames of reasons 0 to 2");
    field("lost_in_queue", self.lost_in_queue, "samples in GAP frames of reasons 3 to 5");
    field("sent_samples", self.sent_samples, "samples in SAMPLES frames");
    field("queued_samples", self.queued_samples, "samples and losses that wait in the box behind this frame");
    field("sent_bytes", self.sent_bytes,
          "bytes of SAMPLES and GAP frames as coded on the wire: the credit that is used up");
    field("queue_high_water", self.queue_high_water, "bytes, the fullest that this link's queue has been");
    field("link", self.link, "what came from the host");
    field("clock_state", self.clock_state, "0 unlocked, 1 locked, 2 holdover, 3 ambiguous");
    field("clock_sigma_ns", self.clock_sigma_ns, "ns, standard deviation (k = 1) of a tick's time");
    field("deadline_misses", self.deadline_misses, "times that the box was late for a tick");
    field("edges", self.edges, "sync edges since the box started");
  }
};

}  // namespace probebox::messages
