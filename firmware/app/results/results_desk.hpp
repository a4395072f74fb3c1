#pragma once
#include <cstddef>
#include <span>

#include "board/describe/service.hpp"
#include "firmware/app/results/calibrations.hpp"
#include "firmware/app/results/incoming_case.hpp"
#include "firmware/app/results/reply.hpp"
#include "firmware/app/threads/core_view.hpp"
#include "firmware/app/threads/time_source.hpp"
#include "protocol/messages/types.hpp"

namespace probebox::app {

// Answers requests that need the store or may wait for the core. On the worker's thread.
class ResultsDesk {
 public:
  ResultsDesk(board::Access access, Calibrations& calibrations, CoreView& core, const TimeSource& time)
      : access_{access}, calibrations_{calibrations}, core_{core}, time_{time} {}

  static bool answers(messages::Operation operation);
  Reply answer(messages::Operation operation, std::span<const std::byte> body);

 private:
  Reply listResults(std::span<const std::byte> body);
  Reply acceptResult(std::span<const std::byte> body);
  Reply rollBack(std::span<const std::byte> body);
  Reply history(std::span<const std::byte> body);
  Reply getDataset(std::span<const std::byte> body);
  Reply proposeCase(std::span<const std::byte> body);
  Reply setInhibit(std::span<const std::byte> body);

  board::Access access_;
  Calibrations& calibrations_;
  CoreView& core_;
  const TimeSource& time_;
  IncomingCase incoming_;
};

}  // namespace probebox::app
