#pragma once
#include <chrono>
#include <cstdint>

#include "tools/link/client.hpp"
#include "tools/probebox/cli/console.hpp"
#include "tools/probebox/cli/request.hpp"

namespace probebox::command {

// When a display that goes on by itself shows its next update, and when it ends.
class Pace {
 public:
  Pace(const Until& until, std::chrono::milliseconds period)
      : period_{period}, next_{link::now()}, remaining_{until.count} {
    if (until.seconds) end_ = link::now() + Nanoseconds{static_cast<std::int64_t>(*until.seconds * 1e9)};
  }

  // True once for every update that is due.
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

// Lets the link do its work for a short while; false when it is lost, or nobody looks any more.
inline bool goRound(link::Client& box, const Console& console) {
  if (console.interrupted() || !console.writable()) return false;
  box.round(link::patience(std::chrono::milliseconds{1000}, &console.interruption()));
  return box.state() != link::LinkState::lost;
}

// How a display that goes on by itself came to its end.
inline ExitStatus ended(const link::Client& box, Console& console) {
  if (console.interrupted()) return ExitStatus::interrupted;
  if (box.state() != link::LinkState::lost) return ExitStatus::ok;
  return console.fail({ExitStatus::no_box, "link-lost", box.failure() ? box.failure()->what : "the link was lost"});
}

}  // namespace probebox::command
