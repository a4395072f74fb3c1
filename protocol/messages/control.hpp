#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "protocol/messages/fields.hpp"
#include "protocol/messages/stream.hpp"
#include "protocol/messages/types.hpp"

// What can be asked of a box. Each operation has its number, a Request and an Answer. Since protocol 1.0.
namespace probebox::messages {

// For requests and answers that say nothing.
struct Nothing {
  static constexpr void fields(auto&, auto&&) {}
};

struct ClockStatus {
  ClockState state{};
  std::uint32_t sigma_ns{};
  double frequency_ppb{};
  Tick tick{};
  EdgeCounters edges{};
  static constexpr void fields(auto& self, auto&& field) {
    field("state", self.state, "0 unlocked, 1 locked, 2 holdover, 3 ambiguous");
    field("sigma_ns", self.sigma_ns, "ns, standard deviation (k = 1) of a tick's time");
    field("frequency_ppb", self.frequency_ppb, "1e-9, master clock against the monotonic clock, positive when fast");
    field("tick", self.tick, "latest tick");
    field("edges", self.edges, "sync edges since the box started");
  }
};

// A probe receiver that counts its samples on an oscillator of its own. Since protocol 1.1.
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
    field("samples", self.samples, "samples that arrived");
    field("missing", self.missing, "samples that its counter left out");
    field("unstamped", self.unstamped, "samples that arrived while nobody could say when they were taken");
    field("restarts", self.restarts, "times that its counter began anew while it was plugged in");
    field("relocks", self.relocks, "times after the first that its clock locked anew");
    field("refused_frequency", self.refused_frequency,
          "times that its rate was refused: more than 200 ppm from rate_hz of probe.toml");
    field("bad_packets", self.bad_packets, "packets that were damaged, or of another version");
  }
};

struct Ledger {
  std::uint64_t produced{};
  std::uint64_t lost_at_source{};
  std::uint64_t lost_in_queue{};
  static constexpr void fields(auto& self, auto&& field) {
    field("produced", self.produced, "samples since the box started, lost ones included");
    field("lost_at_source", self.lost_at_source, "samples that no source delivered");
    field("lost_in_queue", self.lost_in_queue,
          "samples dropped between core and links; each link tells its own drops in its heartbeats");
  }
};

struct EventCounts {
  std::uint64_t received{};
  std::uint64_t lost{};
  std::uint64_t lost_in_queue{};
  std::uint64_t sources_gone{};
  static constexpr void fields(auto& self, auto&& field) {
    field("received", self.received, "events that reached the core");
    field("lost", self.lost,
          "edges, counts and deflections that never reached the core, by the gaps in their sequences");
    field("lost_in_queue", self.lost_in_queue,
          "events for which the capture queue had no room; most are in `lost` too");
    field("sources_gone", self.sources_gone, "times that a source was unplugged or taken away");
  }
};

struct ModbusCounters {
  std::uint64_t requests{};
  std::uint64_t bad_frames{};
  static constexpr void fields(auto& self, auto&& field) {
    field("requests", self.requests, "requests answered, on all lines");
    field("bad_frames", self.bad_frames, "frames with a wrong CRC or length, on all lines");
  }
};

// A driver's view: one line of a chip, a receiver, the emulated machine. Since protocol 1.1.
struct SourceStatus {
  std::string name{};
  std::string problem{};
  std::uint64_t unusable{};
  static constexpr void fields(auto& self, auto&& field) {
    field("name", self.name, "for a person, such as gpiochip0 line 4 (sync)");
    field("problem", self.problem, "why nothing comes from it, and what to do; empty when all is well");
    field("unusable", self.unusable, "what came from the device and is no event");
  }
};

// The core's view: a line that box.toml names. Since protocol 1.1.
struct LineStatus {
  std::string name{};
  std::uint8_t role{};
  std::uint8_t line{};
  std::uint64_t edges{};
  std::uint64_t lost{};
  static constexpr void fields(auto& self, auto&& field) {
    field("name", self.name, "as box.toml has it, such as probe trigger");
    field("role", self.role, "0 sync, 1 trigger, 2 index, 3 skip");
    field("line", self.line, "which line of that role, from 0; of an index line the axis: 0 X, 1 Y, 2 Z");
    field("edges", self.edges, "edges that reached the core, of the kind that is watched for");
    field("lost", self.lost, "edges that never did, by the gaps in the line's sequence");
  }
};

// One serial line to a controller. Since protocol 1.1.
struct CncLineStatus {
  std::string name{};
  std::uint64_t answered{};
  std::uint64_t refused{};
  std::uint64_t bad_frames{};
  std::uint64_t skipped_bytes{};
  std::uint64_t unsent{};
  std::uint64_t reopened{};
  static constexpr void fields(auto& self, auto&& field) {
    field("name", self.name, "its device, such as /dev/ttyS2");
    field("answered", self.answered, "requests answered with what they asked for");
    field("refused", self.refused, "requests answered with an exception");
    field("bad_frames", self.bad_frames, "runs of bytes that were no request");
    field("skipped_bytes", self.skipped_bytes, "bytes in them");
    field("unsent", self.unsent, "answers that the line did not take");
    field("reopened", self.reopened, "times that the line went away and came back");
  }
};

// The box's end of USB. Since protocol 1.1.
struct UsbPortStatus {
  std::string problem{};
  std::uint64_t connections{};
  std::uint64_t suspensions{};
  std::uint64_t discarded_bytes{};
  std::uint64_t failed_transfers{};
  std::uint64_t stalled_requests{};
  static constexpr void fields(auto& self, auto&& field) {
    field("problem", self.problem, "why the box is not on the bus, and what to do; empty when it is");
    field("connections", self.connections, "times that a host configured the box or selected its interface anew");
    field("suspensions", self.suspensions, "times that the bus fell asleep");
    field("discarded_bytes", self.discarded_bytes, "not known to have arrived, or not read, when a connection ended");
    field("failed_transfers", self.failed_transfers, "connections that ended by a failing transfer");
    field("stalled_requests", self.stalled_requests, "control requests that the interface does not know");
  }
};

// Events that reached the core and served nothing, or less than they might have. Since protocol 1.1.
struct UnusedEvents {
  std::uint64_t late{};
  std::uint64_t disordered{};
  std::uint64_t overwritten{};
  std::uint64_t incomplete_rows{};
  std::uint64_t stray_markers{};
  static constexpr void fields(auto& self, auto&& field) {
    field("late", self.late, "came after the sample at their stamp was decided");
    field("disordered", self.disordered, "older than the one before them from the same source");
    field("overwritten", self.overwritten, "pushed out of a full buffer before any sample used them");
    field("incomplete_rows", self.incomplete_rows,
          "latches of a measured touch that lack an axis at the same stamp, and are not in its data");
    field("stray_markers", self.stray_markers, "markers of another run or step than the box is at");
  }
};

struct Status {
  static constexpr Operation kOperation = Operation::status;
  using Request = Nothing;
  struct Answer {
    std::string board{};
    std::string firmware_version{};
    std::uint64_t uptime_ms{};
    ClockStatus clock{};
    Ledger ledger{};
    std::uint32_t queue_high_water{};
    std::uint64_t deadline_misses{};
    EventCounts events{};
    std::string procedure{};
    std::vector<std::uint64_t> active_results{};
    std::uint16_t links{};
    ModbusCounters modbus{};
    LinkCounters from_hosts{};
    std::vector<SourceStatus> sources{};
    std::vector<LineStatus> lines{};
    ReceiverStatus receiver{};
    std::vector<CncLineStatus> cnc_lines{};
    UnusedEvents unused_events{};
    std::uint64_t journal_lost{};
    std::vector<UsbPortStatus> usb_ports{};
    static constexpr void fields(auto& self, auto&& field) {
      field("board", self.board, "name of the board description");
      field("firmware_version", self.firmware_version, "as probeboxd --version prints it");
      field("uptime_ms", self.uptime_ms, "ms since the box started");
      field("clock", self.clock, "the master clock");
      field("ledger", self.ledger, "what became of every sample");
      field("queue_high_water", self.queue_high_water, "events, the fullest that the capture queue has been");
      field("deadline_misses", self.deadline_misses, "times that the box was late for a tick");
      field("events", self.events, "what reached the core");
      field("procedure", self.procedure, "state of the measuring procedure in words");
      field("active_results", self.active_results, "ids of the results in force");
      field("links", self.links, "connected hosts");
      field("modbus", self.modbus, "the lines to the controller");
      field("from_hosts", self.from_hosts, "what came over all links to hosts since the box started, garbage included");
      field("sources", self.sources, "where events come from, and what is missing; since protocol 1.1");
      field("lines", self.lines, "the box's digital inputs; since protocol 1.1");
      field("receiver", self.receiver,
            "the probe receiver, where one is that counts its samples; zeros elsewhere; since protocol 1.1");
      field("cnc_lines", self.cnc_lines, "the lines to the controller, one by one; since protocol 1.1");
      field("unused_events", self.unused_events, "what reached the core for nothing; since protocol 1.1");
      field("journal_lost", self.journal_lost,
            "events that are missing in the journal, where one is written; since protocol 1.1");
      field("usb_ports", self.usb_ports, "the box as a USB device; since protocol 1.1");
    }
  };
};

// A Marker from the host; the box stamps it on arrival.
struct PostMarker {
  static constexpr Operation kOperation = Operation::post_marker;
  struct Request {
    std::uint32_t procedure{};
    std::uint32_t step{};
    StepPhase phase{};
    std::array<double, 3> rotary_angles_rad{};
    std::uint32_t tool{};
    double nominal_speed_mm_s{};
    bool at_rest{};
    static constexpr void fields(auto& self, auto&& field) {
      field("procedure", self.procedure, "the run that the step belongs to, as the box numbered it");
      field("step", self.step, "step of the procedure, from 0");
      field("phase", self.phase, "0 begin, 1 end, 2 abandon (the step will be repeated)");
      field("rotary_angles_rad", self.rotary_angles_rad, "rad, A B C");
      field("tool", self.tool, "tool number, 0 for none");
      field("nominal_speed_mm_s", self.nominal_speed_mm_s, "mm/s, commanded measuring speed of the step");
      field("at_rest", self.at_rest, "1 when all axes stand still");
    }
  };
  using Answer = Nothing;
};

struct StartProcedure {
  static constexpr Operation kOperation = Operation::start_procedure;
  struct Request {
    std::string method{};
    static constexpr void fields(auto& self, auto&& field) {
      field("method", self.method, "such as delay-multi-speed");
    }
  };
  struct Answer {
    std::uint32_t run{};
    static constexpr void fields(auto& self, auto&& field) { field("run", self.run, "number of the run, for markers"); }
  };
};

struct ProcedureStatus {
  static constexpr Operation kOperation = Operation::procedure_status;
  using Request = Nothing;
  struct Answer {
    std::uint32_t run{};
    std::string method{};
    ProcedureState state{};
    std::uint32_t step{};
    std::uint32_t steps{};
    std::string prompt{};
    std::array<double, 3> outward_normal{};
    std::array<double, 3> retract_direction{};
    double overtravel_mm{};
    double clearance_mm{};
    double nominal_speed_mm_s{};
    std::string refusal{};
    std::uint64_t result_id{};
    static constexpr void fields(auto& self, auto&& field) {
      field("run", self.run, "number of the run; 0 before the first");
      field("method", self.method, "such as delay-multi-speed");
      field("state", self.state, "0 idle, 1 waiting, 2 running, 3 solving, 4 proposed, 5 refused, 6 aborted");
      field("step", self.step, "present step, from 0");
      field("steps", self.steps, "how many there are");
      field("prompt", self.prompt, "what to do next, for a person");
      field("outward_normal", self.outward_normal, "unit vector, machine axes X Y Z: out of the surface to be touched");
      field("retract_direction", self.retract_direction, "unit vector, machine axes X Y Z");
      field("overtravel_mm", self.overtravel_mm, "mm to travel into the surface after contact");
      field("clearance_mm", self.clearance_mm, "mm to stay away from the surface before and after");
      field("nominal_speed_mm_s", self.nominal_speed_mm_s, "mm/s, speed to measure this step at");
      field("refusal", self.refusal, "why there is no result, and what to do");
      field("result_id", self.result_id, "the proposed result, 0 for none");
    }
  };
};

struct AbortProcedure {
  static constexpr Operation kOperation = Operation::abort_procedure;
  using Request = Nothing;
  using Answer = Nothing;
};

struct NamedValue {
  std::string key{};
  double value{};
  double sd{};
  bool has_sd{};
  static constexpr void fields(auto& self, auto&& field) {
    field("key", self.key, "name with the unit in it, such as tau_x_s");
    field("value", self.value, "in the unit of the name");
    field("sd", self.sd, "standard deviation (k = 1), the same unit");
    field("has_sd", self.has_sd, "0 when sd says nothing");
  }
};

struct ResultSummary {
  std::uint64_t id{};
  ResultState state{};
  std::string method{};
  std::string proposed_utc{};
  std::string accepted_utc{};
  std::string accepted_by{};
  std::string probe{};
  std::string machine{};
  std::string mounting{};
  std::vector<NamedValue> values{};
  double rms{};
  std::uint32_t dof{};
  double condition{};
  double chi2_reduced{};
  std::vector<std::string> warnings{};
  static constexpr void fields(auto& self, auto&& field) {
    field("id", self.id, "of the result, never used twice");
    field("state", self.state, "0 proposed, 1 accepted, 2 active, 3 retired");
    field("method", self.method, "such as delay-multi-speed");
    field("proposed_utc", self.proposed_utc, "ISO 8601");
    field("accepted_utc", self.accepted_utc, "ISO 8601, empty before");
    field("accepted_by", self.accepted_by, "who, empty before");
    field("probe", self.probe, "the probe that the result is bound to");
    field("machine", self.machine, "the machine that the result is bound to");
    field("mounting", self.mounting, "the mounting that the result is bound to");
    field("values", self.values, "what was found");
    field("rms", self.rms, "root mean square of the residuals, mm");
    field("dof", self.dof, "degrees of freedom");
    field("condition", self.condition, "condition number of the solved system");
    field("chi2_reduced", self.chi2_reduced, "near 1 when the residuals are as large as stated");
    field("warnings", self.warnings, "what a person should know before accepting");
  }
};

struct ListResults {
  static constexpr Operation kOperation = Operation::list_results;
  struct Request {
    std::uint64_t after_id{};
    static constexpr void fields(auto& self, auto&& field) {
      field("after_id", self.after_id, "only results with a higher id; 0 for all");
    }
  };
  struct Answer {
    std::vector<ResultSummary> results{};
    bool more{};
    static constexpr void fields(auto& self, auto&& field) {
      field("results", self.results, "by rising id, as many as one answer holds");
      field("more", self.more, "1 when there are more: ask again with the last id");
    }
  };
};

struct AcceptResult {
  static constexpr Operation kOperation = Operation::accept_result;
  struct Request {
    std::uint64_t id{};
    std::string by{};
    static constexpr void fields(auto& self, auto&& field) {
      field("id", self.id, "of a proposed result");
      field("by", self.by, "who accepts it");
    }
  };
  using Answer = Nothing;
};

// What the CNC is being told.
struct Corrections {
  static constexpr Operation kOperation = Operation::corrections;
  using Request = Nothing;
  struct Answer {
    bool valid{};
    bool degraded{};
    std::array<double, 3> correction_mm{};
    std::uint16_t mask{};
    std::uint16_t sequence{};
    std::uint16_t heartbeat{};
    std::uint32_t age_ms{};
    bool delay_calibrated{};
    std::array<double, 3> tau_s{};
    std::array<double, 3> tau_sd_s{};
    static constexpr void fields(auto& self, auto&& field) {
      field("valid", self.valid, "1 when the values may be used");
      field("degraded", self.degraded, "1 when a value is held or saturated");
      field("correction_mm", self.correction_mm,
            "mm, machine axes X Y Z, radius: to be ADDED to the commanded position");
      field("mask", self.mask, "sources that are summed: bit 0 screw, 1 swivel, 2 rotary, 3 centreline");
      field("sequence", self.sequence, "+1 whenever any correction changes");
      field("heartbeat", self.heartbeat, "+1 every 0.1 s");
      field("age_ms", self.age_ms, "ms since the corrections were computed");
      field("delay_calibrated", self.delay_calibrated, "1 when a result about the system delay is active");
      field("tau_s", self.tau_s, "s, X Y Z, machine minus probe");
      field("tau_sd_s", self.tau_sd_s, "s, X Y Z, standard deviation (k = 1)");
    }
  };
};

// The data of a run, piece by piece, so that a host can save the calibration that it has just seen.
struct GetDataset {
  static constexpr Operation kOperation = Operation::get_dataset;
  struct Request {
    std::uint32_t run{};
    std::uint64_t offset{};
    static constexpr void fields(auto& self, auto&& field) {
      field("run", self.run, "number of the run");
      field("offset", self.offset, "bytes that the host already has");
    }
  };
  struct Answer {
    std::uint64_t total_bytes{};
    std::uint64_t offset{};
    std::string bytes{};
    static constexpr void fields(auto& self, auto&& field) {
      field("total_bytes", self.total_bytes, "of the whole document");
      field("offset", self.offset, "where this piece begins");
      field("bytes", self.bytes, "a piece of the run's data as JSON text");
    }
  };
};

}  // namespace probebox::messages
