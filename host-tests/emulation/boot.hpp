#pragma once
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "firmware/app/host/control_request_handler.hpp"
#include "host-tests/emulation/hosts.hpp"

// The parts of the daemon around its core, for one boot on virtual time: the store with everything in it, and the
// handler that answers controllers. The store's file outlives it.
namespace probebox::scenario {

class Boot {
 public:
  // Nothing is told to the core: that is what restored() is for.
  Boot(Office& office, const std::filesystem::path& file, const procedure::Facts& facts = usualFacts());

  // Events that the core must get first. exactly: the correction that the CNC has read last, if it survived the end.
  std::vector<Event> restored(const app::LastServedAtStart& served = {});
  // Ends the daemon regularly. read: what a CNC has read last.
  void end(const std::optional<app::LastRead>& read = {}) {
    applied_.finish(office_.scenario().state().snapshot, read);
  }
  const app::AppliedCorrectionFile& applied() const { return applied_; }

  void run(Nanoseconds duration);
  // One round of the worker.
  void look(const std::optional<app::LastRead>& read = {});
  // Asks as a controller does, over its control channel. Only for requests that the worker does not answer.
  app::Reply ask(messages::Operation operation, std::span<const std::byte> body = {});
  template <class Operation>
  app::Reply ask(const typename Operation::Request& request) {
    return ask(Operation::kOperation, messages::encoded(request));
  }
  messages::ProcedureStatus::Answer procedure();
  // Markers, homings, poses and cuts from a line of the controller: all of them or none.
  std::optional<Error> take(std::span<const Event> said);
  app::Calibrations& calibrations() { return calibrations_; }
  const app::Calibrations& calibrations() const { return calibrations_; }

  // Starts a run by the handler; 0 when it was refused.
  std::uint32_t start(std::string_view method);
  // The result of the run that goes on, once it is proposed; nothing when it is not within five minutes.
  std::optional<store::Id> finish();
  // Solves the run whose touches are complete; false while there is none.
  bool solve();
  std::optional<store::Record> newestProposed();
  app::ResultsInForce& inForce() { return calibrations_.inForce(); }
  app::ConnectionInhibits& connections() { return connections_; }
  bool accept(store::Id id) { return calibrations_.inForce().accept(id, "Ada").ok(); }

 private:
  void tell(Event event);

  Office& office_;
  app::TimeSource time_;
  app::Counters counters_;
  app::SourceTable sources_;
  app::CommandQueue commands_;
  app::StateBuffer states_;
  app::CoreView core_;
  app::Calibrations calibrations_;
  app::ConnectionInhibits connections_;
  app::AppliedCorrectionFile applied_;
  app::ResultRequestHandler results_;
  app::LoopBackRequestHandler loop_back_;
  app::UnitRequestHandler unit_;
  app::UpdateRequestHandler updates_{{}, {}, {}};
  app::Worker worker_;
  app::ControlRequestHandler handler_;
};

}  // namespace probebox::scenario
