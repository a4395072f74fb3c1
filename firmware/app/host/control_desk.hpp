#pragma once
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "board/describe/service.hpp"
#include "firmware/app/host/loop_back_desk.hpp"
#include "firmware/app/results/calibrations.hpp"
#include "firmware/app/results/reply.hpp"
#include "firmware/app/results/results_desk.hpp"
#include "firmware/app/threads/command_queue.hpp"
#include "firmware/app/threads/counters.hpp"
#include "firmware/app/threads/source_table.hpp"
#include "firmware/app/threads/time_source.hpp"
#include "firmware/app/threads/worker.hpp"
#include "firmware/box/state.hpp"
#include "firmware/procedure/dataset/run_dataset.hpp"
#include "firmware/stream/control_channel.hpp"
#include "protocol/messages/control.hpp"
#include "protocol/messages/types.hpp"

namespace probebox::app {

// What a box says about itself when asked.
struct Identity {
  std::string board;
  std::string firmware_version;
  std::vector<messages::LineStatus> lines;
};

// What the thread of the links knows beyond the box's state.
struct LinkVitals {
  std::uint64_t uptime_ms{};
  messages::LinkCounters from_hosts;  // all links since the start
  std::vector<messages::UsbPortStatus> usb_ports;
};

// Answers what hosts and the CNC ask of the box. Questions about its state are answered at once; what needs the store
// or takes its time goes to the worker and is answered later, through `reply_later`, in the worker's thread. Used by
// the thread of the links, except for post().
class ControlDesk {
 public:
  struct Colleagues {
    double deflection_limit_mm;  // of the probe
    const TimeSource& time;
    CommandQueue& commands;
    Worker& worker;
    const Calibrations& calibrations;
    ResultsDesk& results;
    LoopBackDesk& loop_back;
    Counters& counters;
    const SourceTable& sources;
    std::function<std::vector<messages::CncLineStatus>()> cnc_lines;
  };
  ControlDesk(Identity identity, board::Access access, const Colleagues& colleagues,
              std::function<void(Reply)> reply_later);

  // Nothing now means: later.
  std::optional<Reply> handle(std::uint64_t link, const stream::PendingRequest& request, const box::State& state,
                              const LinkVitals& vitals);

  // Any thread, for markers that come over other faces. nullopt when it was taken, or why not.
  // What a controller says: a marker, an axis that was homed, a cut. The stamp is set here.
  std::optional<Error> post(Event said, const box::State& state);

 private:
  Reply answer(const stream::PendingRequest& request, const box::State& state, const LinkVitals& vitals);
  Reply describeStatus(const box::State& state, const LinkVitals& vitals) const;
  Reply describeProcedure(const box::State& state) const;
  Reply takeMarker(std::span<const std::byte> body, const box::State& state);
  Reply startProcedure(std::span<const std::byte> body, const box::State& state);
  Reply abortProcedure(std::span<const std::byte> body, const box::State& state);
  Reply homeAxes(std::span<const std::byte> body, const box::State& state);
  Reply tellPose(std::span<const std::byte> body, const box::State& state);
  Reply enableSources(std::span<const std::byte> body, const box::State& state);
  void followLoops(const procedure::Progress& progress);
  std::string procedureInWords(const box::State& state) const;
  std::string whereItStands(std::uint64_t result) const;
  std::optional<Reply> askWorker(std::uint64_t link, const stream::PendingRequest& request);

  Identity identity_;
  board::Access access_;
  Colleagues with_;
  std::function<void(Reply)> reply_later_;
  std::uint32_t last_run_{};
  // Of the last run: only the desk starts one.
  procedure::Plan plan_;
  ProcedureOptions options_;
};

}  // namespace probebox::app
