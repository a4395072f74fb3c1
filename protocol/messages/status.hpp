#pragma once
#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "protocol/messages/nothing.hpp"
#include "protocol/messages/stream.hpp"
#include "protocol/messages/types.hpp"
#include "protocol/state/due.hpp"
#include "protocol/state/snapshot.hpp"

// Reports the status of the box: one operation, and the structures in its answer.
namespace probebox::messages {

using published::ClockStatus;
using published::CoreStatus;
using published::EventCounts;
using published::Ledger;
using published::ReceiverStatus;
using published::SecondReceiverStatus;

struct ModbusCounters {
  std::uint64_t requests{};
  std::uint64_t bad_frames{};
  static constexpr void fields(auto& self, auto&& field) {
    field("requests", self.requests, "requests answered, on all lines", published::Counter{});
    field("bad_frames", self.bad_frames, "frames with a wrong CRC or length, on all lines", published::Counter{});
  }
};

// A driver's view: one line of a chip, a receiver, the emulated machine.
struct SourceStatus {
  std::string name{};
  std::string problem{};
  std::uint64_t unusable{};
  std::string faults{};
  static constexpr void fields(auto& self, auto&& field) {
    field("name", self.name, "for a person, such as gpiochip0 line 4 (sync)");
    field("problem", self.problem, "why nothing comes from it, and what to do; empty when all is well",
          published::Complaint{});
    field("unusable_messages", self.unusable, "what came from the device and is no event", published::Counter{});
    field("faults", self.faults,
          "what the device says is wrong with it, now or in the last minute, by name; empty when nothing is",
          published::Complaint{});
  }
};

// A pin of the front end.
struct PinStatus {
  std::string name{};
  std::uint8_t gpio{};
  static constexpr void fields(auto& self, auto&& field) {
    field("name", self.name, "as board/front-end/pins.md has it, such as SYNC");
    field("gpio", self.gpio, "of the chip", published::Identifier{});
  }
};

// What the last kWindow samples of a probe receiver on USB show of its inputs.
struct ReceiverInputs {
  static constexpr std::uint32_t kWindow = 2048;
  std::uint32_t samples{};
  std::array<double, 3> noise_nm{};
  std::array<std::int32_t, 3> lowest_nm{};
  std::array<std::int32_t, 3> highest_nm{};
  std::uint32_t clipped{};
  std::uint32_t loop_back_periods{};
  std::uint32_t shortest_period_steps{};
  std::uint32_t longest_period_steps{};
  static constexpr void fields(auto& self, auto&& field) {
    field("samples", self.samples, "they are; 0 before there were so many");
    field("noise_nm", self.noise_nm,
          "nm, standard deviation (k = 1) of one sample, channels a, b, c, from second differences",
          published::kEachChannel);
    field("lowest_nm", self.lowest_nm, "nm, of the channels", published::kEachChannel);
    field("highest_nm", self.highest_nm, "nm, of the channels", published::kEachChannel);
    field("clipped_samples", self.clipped, "samples with a channel at the end of its range");
    field("loop_back_periods", self.loop_back_periods, "whole periods on its loop-back line");
    field("shortest_period_steps", self.shortest_period_steps, "steps of its counter, the shortest of these periods");
    field("longest_period_steps", self.longest_period_steps, "steps of its counter, the longest of these periods");
  }
};

// What a probe receiver on USB says of itself. Another one than the project's own front end tells no more than its
// serial number and its packets.
struct FrontEndStatus {
  std::string serial_number{};
  std::string version{};
  std::uint8_t packet_version{};
  std::uint8_t counters{};
  std::uint8_t lines{};
  std::uint32_t step_ps{};
  double rate_hz{};
  std::uint16_t samples_a_packet{};
  double sync_out_hz{};
  std::array<double, 3> full_scale_um{};
  std::vector<PinStatus> pins{};
  std::string lacks{};
  double stated_noise_um{};
  ReceiverInputs inputs{};
  bool isThere() const { return packet_version != 0 || !version.empty(); }
  static constexpr void fields(auto& self, auto&& field) {
    field("serial_number", self.serial_number, "of its USB device; empty for none");
    field("version", self.version, "of its program, such as 1.0; empty where it does not tell");
    field("packet_version", self.packet_version, "of its packets; 0 before the first");
    field("counters", self.counters, "axis counters");
    field("lines", self.lines, "lines whose edges it stamps");
    field("step_ps", self.step_ps, "ps, a step of the counter that stamps");
    field("rate_hz", self.rate_hz, "samples a second, on its own oscillator");
    field("samples_a_packet", self.samples_a_packet, "samples in a packet");
    field("sync_out_hz", self.sync_out_hz, "of its sync output; 0: it stays low");
    field("full_scale_um", self.full_scale_um,
          "um at full scale of the converter, channels a, b, c; negative: reversed", published::kEachChannel);
    field("pins", self.pins, "what is wired where");
    field("lacks", self.lacks, "what it lacks of what this firmware knows, and what to do; empty for nothing",
          published::Complaint{});
    field("stated_noise_um", self.stated_noise_um, "um, noise_um of probe.toml");
    field("inputs", self.inputs, "what its samples show of its inputs",
          published::NullUnless{self.inputs.samples != 0});
  }
};

// The core's view: a line that box.toml names.
struct LineStatus {
  std::string name{};
  std::uint8_t role{};
  std::uint8_t line{};
  std::uint64_t edges{};
  std::uint64_t lost{};
  static constexpr void fields(auto& self, auto&& field) {
    field("name", self.name, "as box.toml has it, such as probe trigger");
    field("role", self.role, "0 sync, 1 trigger, 2 index, 3 skip, 4 inhibit", published::Identifier{});
    field("line", self.line, "which line of that role, from 0; of an index line the axis: 0 X, 1 Y, 2 Z",
          published::Identifier{});
    field("received_edges", self.edges, "edges that reached the core, of the kind that is watched for",
          published::Counter{});
    field("lost_edges", self.lost, "edges that never did, by the gaps in the line's sequence", published::Counter{});
  }
};

// One serial line to a controller.
struct CncLineStatus {
  std::string name{};
  std::uint64_t answered{};
  std::uint64_t refused{};
  std::uint64_t bad_frames{};
  std::uint64_t skipped_bytes{};
  std::uint64_t unsent{};
  std::uint64_t reopened{};
  static constexpr void fields(auto& self, auto&& field) {
    field("name", self.name, "its device or address, such as /dev/ttyS2 or 127.0.0.1:502");
    field("answered_requests", self.answered, "requests answered with what they asked for", published::Counter{});
    field("refused_requests", self.refused, "requests answered with an exception", published::Counter{});
    field("bad_frames", self.bad_frames, "runs of bytes that were no request", published::Counter{});
    field("skipped_bytes", self.skipped_bytes, "bytes in them", published::Counter{});
    field("unsent_answers", self.unsent, "answers that the line did not take", published::Counter{});
    field("reopened", self.reopened, "times that the line went away and came back", published::Counter{});
  }
};

// The box's end of USB.
struct UsbPortStatus {
  std::string problem{};
  std::uint64_t connections{};
  std::uint64_t suspensions{};
  std::uint64_t discarded_bytes{};
  std::uint64_t failed_transfers{};
  std::uint64_t stalled_requests{};
  static constexpr void fields(auto& self, auto&& field) {
    field("problem", self.problem, "why the box is not on the bus, and what to do; empty when it is",
          published::Complaint{});
    field("connections", self.connections, "times that a host configured the box or selected its interface anew",
          published::Counter{});
    field("suspensions", self.suspensions, "times that the bus fell asleep", published::Counter{});
    field("discarded_bytes", self.discarded_bytes, "not known to have arrived, or not read, when a connection ended",
          published::Counter{});
    field("failed_transfers", self.failed_transfers, "connections that ended by a failing transfer",
          published::Counter{});
    field("stalled_requests", self.stalled_requests, "control requests that the interface does not know",
          published::Counter{});
  }
};

// A connection that declares a cut.
struct InhibitHolder {
  std::string connection{};
  std::string by{};
  std::string since_utc{};
  static constexpr void fields(auto& self, auto&& field) {
    field("connection", self.connection, "a line of the controller, a link of hosts, or a person");
    field("by", self.by, "who said so; empty for a controller");
    field("since_utc", self.since_utc, "ISO 8601");
  }
};

// Connections over a network that never became a link.
struct NotLetIn {
  std::uint64_t strangers{};
  std::uint64_t silent{};
  std::uint64_t turned_away{};
  static constexpr void fields(auto& self, auto&& field) {
    field("strangers", self.strangers,
          "began with something else than HELLO, such as a web page's request, or did not prove by TLS to be a person "
          "whom the box knows",
          published::Counter{});
    field("silent_connections", self.silent, "said nothing, or no HELLO within 2 s, or gave way to newer ones",
          published::Counter{});
    field("turned_away_hosts", self.turned_away, "said HELLO and got a REFUSAL: no link was free, or another version",
          published::Counter{});
  }
};

// The daemon as the kernel sees it.
struct ProcessStatus {
  std::uint64_t resident_bytes{};
  bool is_root{};
  std::uint64_t capabilities{};
  bool no_new_privileges{};
  bool calls_filtered{};
  static constexpr void fields(auto& self, auto&& field) {
    field("resident_bytes", self.resident_bytes, "bytes of memory; 0: not known, and neither is the rest");
    field("is_root", self.is_root, "it runs as root");
    field("capabilities", self.capabilities, "bits of its effective capabilities (capabilities(7)); 0 for none",
          published::Identifier{});
    field("no_new_privileges", self.no_new_privileges, "it can gain none (PR_SET_NO_NEW_PRIVS)");
    field("calls_filtered", self.calls_filtered, "its system calls are filtered (seccomp)");
  }
};

struct Status {
  static constexpr Operation kOperation = Operation::status;
  using Request = Nothing;
  struct Answer : CoreStatus {
    std::string board{};
    std::string firmware_version{};
    std::uint64_t uptime_ms{};
    std::string utc{};
    std::string date_source{};
    std::uint32_t queue_high_water{};
    std::uint64_t deadline_misses{};
    std::string procedure{};
    std::vector<std::uint64_t> active_results{};
    std::uint16_t links{};
    ModbusCounters modbus{};
    LinkCounters from_hosts{};
    std::vector<SourceStatus> sources{};
    std::vector<LineStatus> lines{};
    std::vector<CncLineStatus> cnc_lines{};
    std::vector<UsbPortStatus> usb_ports{};
    std::vector<InhibitHolder> inhibits{};
    std::vector<std::string> storage_problems{};
    NotLetIn not_let_in{};
    std::string tls_problem{};
    std::vector<std::string> rests_on_retired{};
    std::vector<published::Due> due{};
    ProcessStatus process{};
    std::string update{};
    FrontEndStatus front_end{};
    FrontEndStatus second_front_end{};
    static constexpr void fields(auto& self, auto&& field) {
      field("board", self.board, "name of the board description");
      field("firmware_version", self.firmware_version, "as probeboxd --version prints it");
      field("uptime_ms", self.uptime_ms, "ms since the box started");
      field("utc", self.utc,
            "the date by which results are recorded, ISO 8601; or \"unknown, 12 s after start 7\" where the box cannot "
            "know "
            "it");
      field("date_source", self.date_source,
            "where that comes from, and the most that it may be off as far as it is known");
      CoreStatus::fields(self, field);
      field("queue_high_water_events", self.queue_high_water, "events, the fullest that the capture queue has been");
      field("deadline_misses", self.deadline_misses, "times that the box was late for a tick", published::Counter{});
      field("procedure", self.procedure, "state of the measuring procedure in words");
      field("active_result_ids", self.active_results, "ids of the results in force");
      field("links", self.links, "connected hosts");
      field("modbus", self.modbus, "the lines to the controller");
      field("from_hosts", self.from_hosts, "what came over all links to hosts since the box started, garbage included");
      field("sources", self.sources, "where events come from, and what is missing");
      field("lines", self.lines, "the box's digital inputs");
      field("cnc_lines", self.cnc_lines, "the lines to the controller, one by one");
      field("usb_ports", self.usb_ports, "the box as a USB device");
      field("inhibits", self.inhibits, "the connections that say that a cut is on");
      field("storage_problems", self.storage_problems,
            "what the box cannot store, or has lost, and what to do; empty when all is well");
      field("not_let_in", self.not_let_in, "connections that never became a link");
      field("tls_problem", self.tls_problem,
            "why nobody comes in through tls: links, or will not for long; empty while all is well",
            published::Complaint{});
      field("rests_on_retired", self.rests_on_retired,
            "a sentence for each result in force that rests on a retired result or fails a limit, and for each place "
            "whose "
            "typed and measured values are more than 4 sd apart");
      field("due_subjects", self.due,
            "what machine.toml has a [[requirement]] for, and when it is to be measured again");
      field("process", self.process, "the daemon as the kernel sees it");
      field("update", self.update, "what came of the last update, or how far one is; empty for none");
      field("front_end", self.front_end, "the probe receiver on USB, while one is connected",
            published::NullUnless{self.front_end.isThere()});
      field("second_front_end", self.second_front_end, "the one of [receiver_2] in box.toml, while it is connected",
            published::OmittedUnless{self.second_front_end.isThere()});
    }
  };
};

}  // namespace probebox::messages
