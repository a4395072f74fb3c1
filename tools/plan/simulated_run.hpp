#pragma once
#include <cstdint>

#include "firmware/metrology/solve.hpp"
#include "firmware/procedure/plan/plan.hpp"
#include "tools/plan/set_up.hpp"

namespace probebox::plan {

// A run of the box's own plan on a machine without faults, and what it takes. Steps, windows, readings and solver are
// the box's; the noise is drawn from the seed.
struct SimulatedRun {
  metrology::Solved solved;
  double duration_s{};
};
SimulatedRun simulatedRun(const procedure::Plan& plan, const SetUp& set_up, std::uint64_t seed);

}  // namespace probebox::plan
