#pragma once
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "firmware/metrology/solve.hpp"
#include "firmware/procedure/plan/live_method.hpp"
#include "tools/plan/set_up.hpp"

namespace probebox::plan {

// Simulates a run on a machine without faults. Plan, windows, readings and solver are those of the box; the noise is
// drawn from the seed.
struct SimulatedRun {
  metrology::Solved solved;
  double duration_s{};
  std::size_t steps{};
  std::string axis{};                         // letter of the rotary axis that the run is about; empty for none
  std::vector<std::string> taken_as_exact{};  // as in a forecast
};
// options: complete, as procedure::described() leaves them.
SimulatedRun simulatedRun(const procedure::LiveMethod& method, const ProcedureOptions& options, const SetUp& set_up,
                          std::uint64_t seed);

// Shortest duration of such a run, s: a run whose steps follow from its readings may take longer.
double shortestDuration(const procedure::LiveMethod& method, const ProcedureOptions& options, const SetUp& set_up);

}  // namespace probebox::plan
