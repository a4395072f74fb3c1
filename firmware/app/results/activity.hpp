#pragma once
#include <optional>

#include "protocol/units/outcome.hpp"

namespace probebox::app {

// Whether the machine uses the box now: while it does, the box may not be changed.
struct Activity {
  bool cut_is_on{};  // declared by a connection or an input line
  bool run_is_on{};
};

// Why the box itself may not be changed now, with the remedy.
inline std::optional<Error> whyNotAtRest(const Activity& now) {
  if (now.cut_is_on)
    return Error{
        "cut-on: a cut is on, and the box is not changed during one: go on when it is over (probebox inhibit)."};
  if (now.run_is_on)
    return Error{
        "run-on: a calibration is in progress: go on when it is over, or end it (probebox calibrate --abort)."};
  return std::nullopt;
}

}  // namespace probebox::app
