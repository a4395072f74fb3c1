#pragma once
#include <optional>

#include "firmware/metrology/dataset/result.hpp"
#include "firmware/metrology/touch/retract.hpp"
#include "firmware/metrology/touch/touch.hpp"

namespace probebox::metrology {

// The delay along the retract of a touch, s, and its sd.
struct AlongDelay {
  double tau_s{};
  double sd_s{};
};

// Refuses clocks-differ: with the delay taken out the machine must stand at one place where the deflection rises
// through a level and where it falls through it, whatever the gain is. It does not where the clock of one stream runs
// at another rate, or its stamps jump at rest. Needs the approach in the record; without it nothing is refused.
std::optional<Refusal> clocksDiffer(const Touch& touch, const Retract& retract, const AlongDelay& delay);

}  // namespace probebox::metrology
