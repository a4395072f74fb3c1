#pragma once
#include <cstddef>
#include <optional>
#include <span>
#include <string>

#include "board/describe/service.hpp"
#include "firmware/app/results/calibrations.hpp"
#include "firmware/app/results/door_book.hpp"
#include "firmware/app/results/proposal_desk.hpp"
#include "firmware/app/results/reply.hpp"
#include "firmware/app/threads/core_view.hpp"
#include "protocol/messages/control.hpp"
#include "protocol/messages/types.hpp"

namespace probebox::app {

// Answers requests that need the store or may wait for the core. On the worker's thread.
class ResultsDesk {
 public:
  ResultsDesk(board::Access access, Calibrations& calibrations, CoreView& core, DoorBook& doors)
      : access_{access}, calibrations_{calibrations}, core_{core}, doors_{doors}, proposals_{calibrations} {}

  static bool answers(messages::Operation operation);
  // Calls `then` with the answer: at once, but for a case that is being solved. `door`: what the link came in through.
  void answer(messages::Operation operation, std::span<const std::byte> body, const std::string& door,
              const ProposalDesk::Then& then);
  // To be called again and again.
  void look() { proposals_.look(); }

 private:
  Reply answerAtOnce(messages::Operation operation, std::span<const std::byte> body, const std::string& door);
  Reply listResults(std::span<const std::byte> body);
  Reply acceptResult(std::span<const std::byte> body);
  Reply rollBack(std::span<const std::byte> body);
  Reply history(std::span<const std::byte> body);
  Reply getDataset(std::span<const std::byte> body);
  Reply setInhibit(std::span<const std::byte> body, const std::string& door);

  std::optional<Reply> clearForAnother(const messages::SetInhibit::Request& request);

  board::Access access_;
  Calibrations& calibrations_;
  CoreView& core_;
  DoorBook& doors_;
  ProposalDesk proposals_;
};

}  // namespace probebox::app
