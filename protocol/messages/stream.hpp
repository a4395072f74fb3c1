#pragma once
#include <array>
#include <cstdint>

#include "protocol/messages/fields.hpp"
#include "protocol/messages/types.hpp"
#include "protocol/state/core_status.hpp"

// Frames of the stream other than SAMPLES, whose payload is a block of protocol/codec.
namespace probebox::messages {

using published::EdgeCounters;

// Declares missing samples, box to host, at their place in the stream.
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

// Reports that a trigger line became active, box to host, if START asked for triggers. Numbers are unique.
struct Trigger {
  static constexpr MessageType kType = MessageType::trigger;
  std::uint32_t number{};
  std::uint8_t line{};
  std::uint32_t line_sequence{};
  MonoTime at{};
  Tick tick{};
  std::uint32_t phase_q32{};
  std::uint32_t sigma_ns{};
  ClockState clock_state{};
  std::uint8_t has_position{};
  std::array<double, 3> position_mm{};
  std::array<double, 3> correction_mm{};
  bool correction_valid{};
  bool correction_degraded{};
  std::uint16_t sequence{};
  std::uint8_t has_angle{};
  std::array<double, 3> angle_rad{};
  static constexpr void fields(auto& self, auto&& field) {
    field("number", self.number, "of the trigger, from 1 since the box started");
    field("line", self.line, "which trigger line, from 0");
    field("line_sequence", self.line_sequence, "the kernel's count of this line's edges; edges of both levels count");
    field("at", self.at, "ns, monotonic, of this boot: the stamp");
    field("tick", self.tick, "the last tick of the master clock that is not after it");
    field("phase_q32", self.phase_q32, "2^-32 of a tick that had passed since");
    field("sigma_ns", self.sigma_ns, "ns, standard deviation (k = 1) of the tick's time");
    field("clock_state", self.clock_state,
          "0 unlocked (tick and phase say nothing), 1 locked, 2 holdover, 3 ambiguous");
    field("has_position", self.has_position, "which positions are known: bit 0 X, 1 Y, 2 Z");
    field("position_mm", self.position_mm, "mm, machine position at the trigger, the correction in it");
    field("correction_mm", self.correction_mm,
          "mm, correction at that time: subtract it from measured positions, or it is corrected twice");
    field("correction_valid", self.correction_valid, "1 when it was valid");
    field("correction_degraded", self.correction_degraded, "1 when a value of it was held or saturated");
    field("sequence", self.sequence, "the corrections' sequence then");
    field("has_angle", self.has_angle, "which angles are known: bit 0 A, 1 B, 2 C");
    field("angle_rad", self.angle_rad,
          "rad, A B C: interpolated at the stamp where the axis has an encoder, without a delay taken out; else as the "
          "controller told it last");
  }
};

// Declares missing triggers, box to host, at their place in the stream.
struct TriggerGap {
  static constexpr MessageType kType = MessageType::trigger_gap;
  std::uint32_t first{};
  std::uint32_t count{};
  GapReason reason{};
  static constexpr void fields(auto& self, auto&& field) {
    field("first", self.first, "number of the first missing trigger");
    field("count", self.count, "how many are missing");
    field("reason", self.reason, "3 queue full (too many at once), 4 ring overrun, 5 resume too old");
  }
};

// Counts the frames and bytes that the box received from the host.
struct LinkCounters {
  std::uint64_t frames{};
  std::uint64_t bad_crc{};
  std::uint64_t bad_cobs{};
  std::uint64_t bad_length{};
  std::uint64_t oversize{};
  std::uint64_t discarded_bytes{};
  std::uint64_t unexpected{};
  static constexpr void fields(auto& self, auto&& field) {
    field("frames", self.frames, "good frames from the host", published::Counter{});
    field("bad_crc", self.bad_crc, "frames with a wrong CRC", published::Counter{});
    field("bad_cobs", self.bad_cobs, "frames that are no COBS", published::Counter{});
    field("bad_length", self.bad_length, "frames whose length disagrees", published::Counter{});
    field("oversize", self.oversize, "frames beyond what the box takes", published::Counter{});
    field("discarded_bytes", self.discarded_bytes, "bytes of everything that was no good frame", published::Counter{});
    field("unexpected_frames", self.unexpected, "good frames of unknown type, or that made no sense in their place",
          published::Counter{});
  }
};

// Reports the ledger of this link's stream, box to host, 10 times a second on serial and TCP. At this place in the
// order of frames, exactly: produced = sent_samples + lost_at_source + lost_in_queue = position - start.
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
  std::uint32_t first_trigger{};
  std::uint32_t next_trigger{};
  std::uint32_t sent_triggers{};
  std::uint32_t lost_triggers{};
  static constexpr void fields(auto& self, auto&& field) {
    field("uptime_ms", self.uptime_ms, "ms since the box started");
    field("streaming", self.streaming, "1 between START and STOP");
    field("stream_number", self.stream_number, "+1 every START since HELLO, 0 before the first: whose ledger this is");
    field("start", self.start, "first sample of this link's stream");
    field("position", self.position, "next sample of this link's stream");
    field("produced", self.produced, "samples of the stream so far, sent or declared lost");
    field("lost_at_source", self.lost_at_source, "samples in GAP frames of reasons 0 to 2");
    field("lost_in_queue", self.lost_in_queue, "samples in GAP frames of reasons 3 to 5");
    field("sent_samples", self.sent_samples, "samples in SAMPLES and SHORT_SAMPLES frames");
    field("queued_samples", self.queued_samples, "samples and losses that wait in the box after this frame");
    field("sent_bytes", self.sent_bytes,
          "bytes of SAMPLES, SHORT_SAMPLES and GAP frames as coded on the wire: the credit that is used up");
    field("queue_high_water", self.queue_high_water, "bytes, the fullest that this link's queue has been");
    field("link", self.link, "what came from the host");
    field("clock_state", self.clock_state, "0 unlocked, 1 locked, 2 holdover, 3 ambiguous");
    field("clock_sigma_ns", self.clock_sigma_ns, "ns, standard deviation (k = 1) of a tick's time");
    field("deadline_misses", self.deadline_misses, "times that the box was late for a tick");
    field("edges", self.edges, "sync edges since the box started");
    field("first_trigger", self.first_trigger,
          "number of the first trigger of this link's stream; 0 where START asked for none, and in a replay while none "
          "has "
          "come");
    field("next_trigger", self.next_trigger, "number of the next one");
    field("sent_triggers", self.sent_triggers, "in TRIGGER frames");
    field("lost_triggers", self.lost_triggers, "in TRIGGER_GAP frames");
  }
};

// Stands for a HEARTBEAT, box to host: what has changed since an earlier one (protocol/frame/changes.hpp) follows the
// field.
struct HeartbeatChange {
  static constexpr MessageType kType = MessageType::heartbeat_change;
  std::uint32_t base{};
  static constexpr void fields(auto& self, auto&& field) {
    field(
        "base", self.base,
        "CRC-32C of the payload of that HEARTBEAT, or of that HEARTBEAT_CHANGE from zeros; 0: changes from zeros, once "
        "a second");
  }
};

// Stands for SAMPLES, box to host: how its head differs from that of the latest block that went whole, then the
// columns (protocol/compact).
struct ShortSamples {
  static constexpr MessageType kType = MessageType::short_samples;
  std::uint32_t base{};
  static constexpr void fields(auto& self, auto&& field) {
    field("base", self.base, "CRC-32C of that block's descriptor hash, as u32, and of its bytes before the columns");
  }
};

}  // namespace probebox::messages
