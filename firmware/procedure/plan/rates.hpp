#pragma once
#include <array>
#include <optional>

#include "firmware/procedure/facts/facts.hpp"
#include "firmware/procedure/plan/step.hpp"
#include "protocol/events/event.hpp"
#include "protocol/units/outcome.hpp"

namespace probebox::procedure {

// Samples per second that arrive from the encoders of X, Y, Z and from the probe.
struct Rates {
  std::array<double, kLinearAxes> positions_hz{};
  double deflections_hz{};
};

// The rates that a step needs so that every window of its solver holds enough samples; 0: any rate will do.
struct NeededRates {
  double positions_hz{};
  double deflections_hz{};
};
NeededRates neededRates(const Step& step, const Facts& facts);

// Explains which source delivers too few samples for a step of the plan, with both rates and the remedy; nullopt when
// all suffice. The readings of the plan are those of the box's probe (takeReadings).
std::optional<Error> whyTooSlow(const Plan& plan, const Facts& facts, const Rates& measured);

}  // namespace probebox::procedure
