#pragma once
#include <cstddef>
#include <cstdint>
#include <string>

#include "firmware/metrology/solve.hpp"
#include "firmware/procedure/plan/live_method.hpp"
#include "tools/plan/set_up.hpp"

namespace probebox::plan {

// A run of the box's own plan on a machine without faults, and what it takes. Steps, windows, readings and solver are
// the box's; the noise is drawn from the seed.
struct SimulatedRun {
  metrology::Solved solved;
  double duration_s{};
  std::size_t steps{};
  std::string axis{};  // of the rotary axis that it is about; empty for none
};
// options: complete, as procedure::described() leaves them.
SimulatedRun simulatedRun(const procedure::LiveMethod& method, const ProcedureOptions& options, const SetUp& set_up,
                          std::uint64_t seed);

// How long such a run takes at least: a run whose steps follow from its readings may have more of them.
double shortestDuration(const procedure::LiveMethod& method, const ProcedureOptions& options, const SetUp& set_up);

}  // namespace probebox::plan
