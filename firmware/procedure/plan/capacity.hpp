#pragma once
#include <optional>

#include "firmware/capture/recording.hpp"
#include "firmware/procedure/plan/rates.hpp"
#include "firmware/procedure/plan/step.hpp"
#include "protocol/units/outcome.hpp"

namespace probebox::procedure {

inline constexpr const char* kExceedsCapacity =
    "the run exceeds the recording capacity of the box: choose fewer or faster touches";

// Explains that a recording cannot hold the touches of a plan, each from its contact until the machine has retracted by
// all that the solvers read, at the speed of the touch both ways and without a dwell; nullopt when it may.
std::optional<Error> whyTooLongToRecord(const Plan& plan, const Rates& rates, const capture::Capacity& capacity = {});

}  // namespace probebox::procedure
