#pragma once
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <optional>
#include <span>

#include "firmware/app/results/calibrations.hpp"
#include "firmware/app/results/incoming_case.hpp"
#include "firmware/app/results/reply.hpp"
#include "protocol/units/outcome.hpp"

namespace probebox::app {

// Takes cases that hosts propose and reports their outcome. One is solved at a time. A case whose host stops asking is
// cancelled, and nothing of it is stored. For the worker's thread.
class ProposalRequestHandler {
 public:
  using Then = std::function<void(Reply)>;
  using Clock = std::chrono::steady_clock;
  explicit ProposalRequestHandler(Calibrations& calibrations) : calibrations_{calibrations} {}

  // Answers a piece of a case. `then` is called at once, except for the last piece from a host that does not follow().
  void propose(std::span<const std::byte> body, Then then);
  Reply follow(std::span<const std::byte> body);
  // Call periodically: cancels a case whose host has stopped asking.
  void look(Clock::time_point now = Clock::now());

 private:
  // The case that is being solved.
  struct Current {
    std::uint32_t number{};
    bool followed{};
    Clock::time_point since;
    Clock::time_point asked;
    Then then;
  };
  struct Finished {
    std::uint32_t number{};
    Outcome<Calibrations::Proposed> outcome;
  };
  void finish(Outcome<Calibrations::Proposed> outcome);

  Calibrations& calibrations_;
  IncomingCase incoming_;
  std::optional<Current> current_;
  std::deque<Finished> finished_;
};

}  // namespace probebox::app
