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

// Takes cases that hosts propose, and tells what comes of them. One is solved at a time. What its host does not ask
// after any more is given up, and nothing of it is stored. On the worker's thread.
class ProposalDesk {
 public:
  using Then = std::function<void(Reply)>;
  using Clock = std::chrono::steady_clock;
  explicit ProposalDesk(Calibrations& calibrations) : calibrations_{calibrations} {}

  // Answers a piece of a case: `then` is called at once, but for the last piece of a host that does not follow.
  void propose(std::span<const std::byte> body, Then then);
  Reply follow(std::span<const std::byte> body);
  // To be called again and again: gives up what nobody asks after.
  void look(Clock::time_point now = Clock::now());

 private:
  // Being solved.
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
