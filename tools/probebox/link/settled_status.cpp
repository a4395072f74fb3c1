#include "tools/probebox/link/settled_status.hpp"

#include <thread>

namespace probebox::command {

Outcome<messages::Status::Answer, Trouble> settledStatus(link::Client& box, Console& console) {
  constexpr milliseconds kClockPatience{20'000}, kClockPeriod{250};
  const auto deadline = link::now() + kClockPatience;
  while (true) {
    auto status = ask<messages::Status>(box, console);
    if (!status || status->clock.state == ClockState::locked || link::now() > deadline) return status;
    console.progress("waiting for the master clock");
    std::this_thread::sleep_for(kClockPeriod);
    if (console.interrupted()) return interruption();
  }
}

std::optional<Trouble> whyNotAtRest(link::Client& box, const Console& console) {
  TRY(const auto run, ask<messages::ProcedureStatus>(box, console));
  const bool measures =
      run.state == RunState::waiting || run.state == RunState::running || run.state == RunState::solving;
  TRY(const auto corrections, ask<messages::Corrections>(box, console));
  if (!measures && !corrections.inhibited) return std::nullopt;
  return Trouble{
      ExitStatus::box_refused, "wrong_state",
      std::string{measures ? "a measuring procedure is in progress" : "a cut is on"} + ": wait until it is over"};
}

}  // namespace probebox::command
