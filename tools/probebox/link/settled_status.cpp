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

}  // namespace probebox::command
