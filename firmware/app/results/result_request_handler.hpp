#pragma once
#include <cstddef>
#include <optional>
#include <span>
#include <string>

#include "firmware/app/results/calibrations.hpp"
#include "firmware/app/results/caller.hpp"
#include "firmware/app/results/connection_inhibits.hpp"
#include "firmware/app/results/proposal_request_handler.hpp"
#include "firmware/app/results/reply.hpp"
#include "firmware/app/threads/core_view.hpp"
#include "protocol/messages/control.hpp"
#include "protocol/messages/types.hpp"

namespace probebox::app {

// Answers requests that need the store or may wait for the core. For the worker's thread.
class ResultRequestHandler {
 public:
  ResultRequestHandler(Calibrations& calibrations, CoreView& core, ConnectionInhibits& connections)
      : calibrations_{calibrations}, core_{core}, connections_{connections}, proposals_{calibrations} {
    calibrations.inForce().setCutGuards([&connections] { return connections.tryLockOutCuts(); },
                                        [&core] { return core.newest().snapshot.inhibited; });
  }

  static bool answers(messages::Operation operation);
  // Calls `then` with the answer, at once except for a case that is being solved.
  void answer(messages::Operation operation, std::span<const std::byte> body, const Caller& caller,
              const ProposalRequestHandler::Then& then);
  // Call periodically.
  void look() { proposals_.look(); }

 private:
  Reply answerAtOnce(messages::Operation operation, std::span<const std::byte> body, const Caller& caller);
  Reply listResults(std::span<const std::byte> body);
  Reply acceptResult(std::span<const std::byte> body, const board::Access& may);
  void sayWhenItIsTrue();
  Reply rollBack(std::span<const std::byte> body, const board::Access& may);
  Reply history(std::span<const std::byte> body);
  Reply getDataset(std::span<const std::byte> body);
  Reply getResult(std::span<const std::byte> body);
  Reply setInhibit(std::span<const std::byte> body, const Caller& caller);

  std::optional<Reply> clearForAnother(const messages::SetInhibit::Request& request, const board::Access& may);

  Calibrations& calibrations_;
  CoreView& core_;
  ConnectionInhibits& connections_;
  ProposalRequestHandler proposals_;

  // The document that a host reads piece by piece, kept so that megabytes are not read from the store for every piece.
  struct Document {
    store::Id id{};
    messages::ResultDocument kind{};
    bool dataset_kept{};
    std::string text;
  };
  Document document_;
};

}  // namespace probebox::app
