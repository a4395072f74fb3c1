#pragma once
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "board/describe/service.hpp"
#include "firmware/app/host/loop_back_request_handler.hpp"
#include "firmware/app/host/machine_description.hpp"
#include "firmware/app/host/unit_request_handler.hpp"
#include "firmware/app/results/applied_correction_file.hpp"
#include "firmware/app/results/calibrations.hpp"
#include "firmware/app/results/caller.hpp"
#include "firmware/app/results/connection_inhibits.hpp"
#include "firmware/app/results/due_dates.hpp"
#include "firmware/app/results/machine_range.hpp"
#include "firmware/app/results/reply.hpp"
#include "firmware/app/results/result_request_handler.hpp"
#include "firmware/app/threads/command_queue.hpp"
#include "firmware/app/threads/counters.hpp"
#include "firmware/app/threads/source_table.hpp"
#include "firmware/app/threads/time_source.hpp"
#include "firmware/app/threads/worker.hpp"
#include "firmware/app/update/update_request_handler.hpp"
#include "firmware/box/state.hpp"
#include "firmware/procedure/plan/run_dataset.hpp"
#include "firmware/stream/control_channel.hpp"
#include "protocol/messages/control.hpp"
#include "protocol/messages/types.hpp"

namespace probebox::app {

// Identity of the box for hosts.
struct Identity {
  std::string board;
  std::string firmware_version;
  std::vector<messages::LineStatus> lines;
  MachineNames machine{};
};

// State that only the thread of the links knows.
struct LinkVitals {
  std::uint64_t uptime_ms{};
  messages::LinkCounters from_hosts;  // all links since the start
  std::vector<messages::UsbPortStatus> usb_ports;
  messages::NotLetIn not_let_in;
  std::string tls_problem{};
};

// Answers requests of hosts and the CNC. Questions about the state are answered at once; requests that need the store
// or take time go to the worker, which answers through `reply_later`. Used by the thread of the links, except for
// take().
class ControlRequestHandler {
 public:
  struct Dependencies {
    double deflection_limit_mm;  // of the probe
    const TimeSource& time;
    CommandQueue& commands;
    Worker& worker;
    const Calibrations& calibrations;
    ResultRequestHandler& results;
    LoopBackRequestHandler& loop_back;
    UnitRequestHandler& unit;
    UpdateRequestHandler& updates;
    ConnectionInhibits& connections;
    const AppliedCorrectionFile& applied;
    Counters& counters;
    const SourceTable& sources;
    std::function<std::vector<messages::CncLineStatus>()> cnc_lines;
    MachineTravel travel{};
    std::uint8_t control_axes{};  // axes whose positions the controller sends: bit 0 X, 1 Y, 2 Z, 3 A, 4 B, 5 C
    std::string boots_problem{};  // of the counter of starts, for status
    const DueDates* due{};        // null: nothing is ever due
  };
  ControlRequestHandler(Identity identity, const Dependencies& dependencies, std::function<void(Reply)> reply_later);

  // Returns nothing when the answer comes later, through `reply_later`.
  std::optional<Reply> handle(const Caller& caller, const stream::PendingRequest& request, const box::State& state,
                              const LinkVitals& vitals);

  // Takes markers, homed axes, poses and cuts from the controller, on any thread: all of them or none. Sets the stamps.
  // Waits for the disk when a cut begins or ends. connection: the line that declares the cut. may: rights of the
  // controller. Returns why they were refused; nullopt when they were taken.
  std::optional<Error> take(std::span<const Event> said, const std::string& connection, const box::State& state,
                            const board::Access& may);

 private:
  // The same once its signature is that of the person who sent it.
  std::optional<Reply> handleSigned(const Caller& caller, const stream::PendingRequest& request,
                                    const box::State& state, const LinkVitals& vitals);
  Reply answer(const board::Access& may, const stream::PendingRequest& request, const box::State& state,
               const LinkVitals& vitals);
  Reply describeStatus(const box::State& state, const LinkVitals& vitals) const;
  Reply describeProcedure(const box::State& state) const;
  Reply takeMarker(const board::Access& may, std::span<const std::byte> body, const box::State& state);
  Reply startProcedure(const board::Access& may, std::span<const std::byte> body, const box::State& state);
  Reply abortProcedure(const board::Access& may, std::span<const std::byte> body, const box::State& state);
  Reply homeAxes(const board::Access& may, std::span<const std::byte> body, const box::State& state);
  Reply tellPose(const board::Access& may, std::span<const std::byte> body, const box::State& state);
  Reply tellPositions(const board::Access& may, std::span<const std::byte> body, const box::State& state);
  Reply enableSources(const board::Access& may, std::span<const std::byte> body, const box::State& state);
  void followLoops(const procedure::Progress& progress);
  std::string procedureInWords(const box::State& state) const;
  std::string whereItStands(std::uint64_t result) const;
  std::optional<Error> whyNot(const Event& said, const box::State& state, const board::Access& may) const;
  std::optional<Error> post(Event said, const box::State& state, const board::Access& may);
  std::optional<Error> whyNotProvision(const Caller& caller, const box::State& state) const;
  std::optional<Reply> askWorker(const Caller& caller, const stream::PendingRequest& request);

  Identity identity_;
  Dependencies deps_;
  std::function<void(Reply)> reply_later_;
  std::uint32_t last_run_{};
  // Plan of the last run, and the probe that it was made for; only this class starts runs.
  procedure::Plan plan_;
  procedure::ProbeKind probe_{};
  ProcedureOptions options_;
};

}  // namespace probebox::app
