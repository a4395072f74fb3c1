#pragma once
#include <optional>
#include <string>
#include <vector>

#include "firmware/metrology/dataset/result.hpp"
#include "protocol/units/outcome.hpp"
#include "tools/plan/set_up.hpp"
#include "tools/plan/wanted.hpp"

namespace probebox::plan {

// The uncertainty that a run will have, before anybody measures.
struct Forecast {
  Wanted wanted;
  std::size_t steps{};  // touches, holds or sweeps
  double duration_s{};
  // Keys, shapes and sd (k = 1) as the result's; values are those of the simulation.
  std::vector<metrology::Estimate> estimates;
  std::vector<metrology::Estimate> also;    // found on the way by one run, such as the angles of a rotary axis
  std::string axis;                         // letter of the rotary axis that the run is about; empty for none
  std::vector<metrology::Dropped> dropped;  // touches that such a run would leave out, and why
};

// What the box's solver says of simulated runs of this plan: its sd, as the root mean square over some of them. The sd
// of a result is honest, so that it is also what the result will scatter by. Refusal: of the run as it is planned,
// which no such run on a machine would escape; not-forecast for what has no result.
Outcome<Forecast, metrology::Refusal> forecast(const Wanted& wanted, const SetUp& set_up);

// Runs that fit into the time, the most precise first: other speeds, repeats, angles, numbers of balls or turns,
// whatever is left open. By the sd of the first component of the method's first estimate. Empty when none fits.
// Refusal: the first one, where every run is refused.
Outcome<std::vector<Forecast>, metrology::Refusal> proposals(const Wanted& wanted, const SetUp& set_up, double time_s);

}  // namespace probebox::plan
