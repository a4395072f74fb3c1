#pragma once
#include <cstdint>

#include "protocol/state/kind_of_value.hpp"
#include "protocol/state/shown_when.hpp"
#include "protocol/units/time.hpp"

// What the core says of its clock, samples and events.
namespace probebox::published {

// Counts the edges of the master clock by their use.
struct EdgeCounters {
  std::uint64_t accepted{};
  std::uint64_t missing{};
  std::uint64_t doubled{};
  std::uint64_t spurious{};
  std::uint64_t lost{};
  std::uint64_t unlocked{};
  static constexpr void fields(auto& self, auto&& field) {
    field("accepted_edges", self.accepted, "edges that became a tick", Counter{});
    field("missing_edges", self.missing, "ticks without an edge", Counter{});
    field("doubled_edges", self.doubled, "second edges of one tick", Counter{});
    field("spurious_edges", self.spurious, "edges that fit no tick", Counter{});
    field("lost_edges", self.lost, "edges that the kernel dropped, by its line sequence number", Counter{});
    field("unlocked_edges", self.unlocked, "edges that came while no clock could give them a tick", Counter{});
  }
};

struct ClockStatus {
  ClockState state{};
  std::uint32_t sigma_ns{};
  double frequency_ppb{};
  Tick tick{};
  EdgeCounters edges{};
  std::uint32_t absolute_sigma_ns{};
  static constexpr void fields(auto& self, auto&& field) {
    field("state", self.state, "0 unlocked, 1 locked, 2 holdover, 3 ambiguous");
    field("sigma_ns", self.sigma_ns,
          "ns, standard deviation (k = 1) of a tick's time; among the samples, where the sync line is on the receiver");
    field("frequency_ppb", self.frequency_ppb, "1e-9, master clock against the monotonic clock, positive when fast");
    field("tick", self.tick, "latest tick");
    field("edges", self.edges, "sync edges since the box started");
    field("absolute_sigma_ns", self.absolute_sigma_ns,
          "ns, standard deviation (k = 1) of a tick's time on this computer's monotonic clock; 4e9: not known");
  }
};

// A probe receiver that counts its samples on an oscillator of its own.
struct ReceiverStatus {
  ClockState state{};
  std::uint32_t sigma_ns{};
  double frequency_ppb{};
  std::uint64_t samples{};
  std::uint64_t missing{};
  std::uint64_t unstamped{};
  std::uint64_t restarts{};
  std::uint64_t relocks{};
  std::uint64_t refused_frequency{};
  std::uint64_t bad_packets{};
  static constexpr void fields(auto& self, auto&& field) {
    field("state", self.state,
          "of its counter against the monotonic clock: 0 unlocked, 1 locked, 2 holdover, 3 ambiguous");
    field("sigma_ns", self.sigma_ns, "ns, standard deviation (k = 1) of a sample's time");
    field("frequency_ppb", self.frequency_ppb, "1e-9, its oscillator against the monotonic clock, positive when fast");
    field("arrived_samples", self.samples, "samples that arrived", Counter{});
    field("missing_samples", self.missing, "samples that its counter left out", Counter{});
    field("unstamped_samples", self.unstamped, "samples that arrived while nobody could say when they were taken",
          Counter{});
    field("restarts", self.restarts, "times that its counter began anew while it was plugged in", Counter{});
    field("relocks", self.relocks, "times after the first that its clock locked anew", Counter{});
    field("refused_frequency", self.refused_frequency,
          "times that its rate was refused: more than 200 ppm from rate_hz of probe.toml", Counter{});
    field("bad_packets", self.bad_packets, "packets that were damaged, or of another version", Counter{});
  }
};

// The second receiver on the sync line of the first: its counter is mapped onto that of the first.
struct SecondReceiverStatus {
  ClockState state{};
  std::uint32_t sigma_ns{};
  double frequency_ppb{};
  std::uint64_t samples{};
  std::uint64_t missing{};
  std::uint64_t unstamped{};
  std::uint64_t restarts{};
  std::uint64_t matched{};
  std::uint64_t unmatched{};
  std::uint64_t unseen{};
  std::uint64_t misfits{};
  std::uint64_t bad_packets{};
  static constexpr void fields(auto& self, auto&& field) {
    field("state", self.state, "of its counter against the first's: 0 unlocked, 1 locked, 2 holdover, 3 ambiguous");
    field("sigma_ns", self.sigma_ns, "ns, standard deviation (k = 1) of its samples' times among those of the first");
    field("frequency_ppb", self.frequency_ppb, "1e-9, its oscillator against the first's, positive when fast");
    field("arrived_samples", self.samples, "samples that arrived", Counter{});
    field("missing_samples", self.missing, "samples that its counter left out", Counter{});
    field("unstamped_samples", self.unstamped, "samples that arrived while nobody could say when they were taken",
          Counter{});
    field("restarts", self.restarts, "times that the map began anew after the first", Counter{});
    field("matched_edges", self.matched, "sync edges that both have seen", Counter{});
    field("unmatched_edges", self.unmatched, "sync edges that it has seen, and the first has not", Counter{});
    field("unseen_edges", self.unseen, "sync edges that the first has seen, and it has not", Counter{});
    field("misfits", self.misfits, "matched edges that are further from the map than its steps explain", Counter{});
    field("bad_packets", self.bad_packets, "packets that were damaged, or of another version", Counter{});
  }
};

// What became of every sample: each index that the latch has decided is recorded or declared lost, once.
struct Ledger {
  std::uint64_t produced{};
  std::uint64_t lost_at_source{};
  std::uint64_t lost_in_queue{};
  static constexpr void fields(auto& self, auto&& field) {
    field("produced_samples", self.produced, "samples since the box started, lost ones included", Counter{});
    field("lost_at_source_samples", self.lost_at_source, "samples that no source delivered", Counter{});
    field("lost_in_queue_samples", self.lost_in_queue,
          "samples dropped between core and links; each link tells its own drops in its heartbeats", Counter{});
  }
};

// What became of everything that reached the core, or should have.
struct EventCounts {
  std::uint64_t received{};
  std::uint64_t lost{};
  std::uint64_t lost_in_queue{};
  std::uint64_t late{};
  std::uint64_t disordered{};
  std::uint64_t overwritten{};
  std::uint64_t incomplete_rows{};
  std::uint64_t stray_markers{};
  std::uint64_t lost_in_journal{};
  std::uint64_t sources_gone{};
  static constexpr void fields(auto& self, auto&& field) {
    field("received_events", self.received, "events that reached the core", Counter{});
    field("lost_events", self.lost,
          "edges, counts and deflections that never reached the core, by the gaps in their sequences", Counter{});
    field("lost_in_queue_events", self.lost_in_queue,
          "events for which the capture queue had no room; most are in `lost_events` too", Counter{});
    field("late_events", self.late, "came after the sample at their stamp was decided", Counter{});
    field("disordered_events", self.disordered, "older than the one before them from the same source", Counter{});
    field("overwritten_events", self.overwritten, "pushed out of a full buffer before any sample used them", Counter{});
    field("incomplete_rows", self.incomplete_rows,
          "latches of a measured touch that lack an axis at the same stamp, and are not in its data", Counter{});
    field("stray_markers", self.stray_markers, "markers of another run or step than the box is at", Counter{});
    field("lost_journal_events", self.lost_in_journal, "events that are missing in the journal, where one is written",
          Counter{});
    field("sources_gone", self.sources_gone, "times that a source was unplugged or taken away", Counter{});
  }
};

// What the core says of itself.
struct CoreStatus {
  ClockStatus clock{};
  ReceiverStatus receiver{};
  Ledger ledger{};
  EventCounts events{};
  SecondReceiverStatus second_receiver{};
  static constexpr void fields(auto& self, auto&& field) {
    field("clock", self.clock, "the master clock");
    field("receiver", self.receiver, "the probe receiver, where one is that counts its samples; zeros elsewhere",
          NullUnless{self.receiver.samples != 0});
    field("ledger", self.ledger, "what became of every sample");
    field("events", self.events, "what reached the core");
    field("second_receiver", self.second_receiver, "the receiver of [receiver_2] in box.toml; zeros without it",
          OmittedUnless{self.second_receiver.samples != 0});
  }
};

}  // namespace probebox::published
