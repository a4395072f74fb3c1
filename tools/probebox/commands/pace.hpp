#pragma once
#include <algorithm>
#include <chrono>
#include <cstdint>

#include "tools/link/client.hpp"
#include "tools/probebox/cli/console.hpp"
#include "tools/probebox/cli/request.hpp"

namespace probebox::command {

// Paces a live display: when the next update is due, and when the display ends.
class Pace {
 public:
  Pace(const Until& until, std::chrono::milliseconds period)
      : period_{period}, next_{link::now()}, remaining_{until.count} {
    constexpr double kLongest_s = 1e9;  // as nanoseconds it still is a time
    if (until.seconds)
      end_ = link::now() + Nanoseconds{static_cast<std::int64_t>(std::min(*until.seconds, kLongest_s) * 1e9)};
  }

  // Returns true once for every update that is due.
  bool due() {
    const auto now = link::now();
    if (now < next_) return false;
    next_ = now + period_;
    if (remaining_ && *remaining_ > 0) --*remaining_;
    return true;
  }
  bool over() const { return remaining_ == 0U || (end_ && link::now() >= *end_); }

 private:
  Nanoseconds period_;
  MonoTime next_;
  std::optional<std::uint64_t> remaining_;
  std::optional<MonoTime> end_;
};

// Serves the link for at most 1 s; false after a lost link, Ctrl-C, or when no one reads the output any more.
inline bool goRound(link::Client& box, const Console& console) {
  if (console.interrupted() || !console.writable()) return false;
  box.round(link::patience(std::chrono::milliseconds{1000}, &console.interruption()));
  return box.state() != link::LinkState::lost;
}

// Returns the exit status of a live display that has ended; reports a lost link.
inline ExitStatus ended(const link::Client& box, Console& console) {
  if (console.interrupted()) return ExitStatus::interrupted;
  if (box.state() != link::LinkState::lost) return ExitStatus::ok;
  return console.fail({ExitStatus::no_box, "link-lost", box.failure() ? box.failure()->what : "the link was lost"});
}

}  // namespace probebox::command
