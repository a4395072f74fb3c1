#pragma once
#include <optional>
#include <vector>

#include "protocol/messages/control.hpp"
#include "protocol/messages/handshake.hpp"
#include "tools/fleet/metrics/exposition.hpp"

namespace probebox::fleet {

// What a box has answered about itself.
struct Observed {
  messages::Descriptor descriptor;
  messages::Status::Answer status;
  std::optional<messages::Corrections::Answer> corrections{};  // a recording that is served as a box has none
  std::optional<messages::DescribeUnit::Answer> unit{};
  std::vector<messages::ResultSummary> in_force{};
};

// Of one result; `probebox show` has all.
inline constexpr std::size_t kMostValuesOfAResult = 12;

// Adds every value of the field lists of status and corrections, in SI units: clock.sigma_ns becomes
// probebox_clock_sigma_seconds. What the box does not know now, names, and numbers of results are left out. null: the
// box does not answer.
void addBox(Exposition& to, const Observed* box);

}  // namespace probebox::fleet
