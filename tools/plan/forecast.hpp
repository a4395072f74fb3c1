#pragma once
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "firmware/metrology/dataset/result.hpp"
#include "protocol/units/outcome.hpp"
#include "tools/plan/set_up.hpp"
#include "tools/plan/wanted.hpp"

namespace probebox::plan {

// Forecast uncertainty of a run.
struct Forecast {
  Wanted wanted;
  std::size_t steps{};  // touches, holds or sweeps
  double duration_s{};
  // As in the result of such a run: keys, shapes, sd (k = 1). The values are simulated.
  std::vector<metrology::Estimate> estimates;
  std::vector<metrology::Estimate> also;    // further estimates of one run, such as the angles of a rotary axis
  std::string axis;                         // letter of the rotary axis that the run is about; empty for none
  std::vector<metrology::Dropped> dropped;  // touches that such a run would leave out, and why
  std::vector<std::string> in_u;            // what the combined uncertainty holds beside the readings, by budget line
  std::vector<std::string> taken_as_exact;  // quantities whose sd is not in it, by the key that would state it
};

// Simulates some runs of this plan, solves them with the box's solver, and returns the root mean square of the stated
// sd, which is also the expected scatter of the result. Refusal: every such run on a machine would be refused, too; or
// not-forecast for a method without a result.
Outcome<Forecast, metrology::Refusal> forecast(const Wanted& wanted, const SetUp& set_up);

// Finds runs that fit into the time by varying the options that are left open (speeds, repeats, angles, numbers of
// balls or turns), the most precise first, by the combined uncertainty of the first component of the method's first
// estimate. Empty when none fits. Refusal: that of the first candidate, if every one is refused. stopped: asked before
// each candidate; true ends the search.
Outcome<std::vector<Forecast>, metrology::Refusal> proposals(
    const Wanted& wanted, const SetUp& set_up, double time_s,
    const std::function<bool()>& stopped = [] { return false; });

}  // namespace probebox::plan
