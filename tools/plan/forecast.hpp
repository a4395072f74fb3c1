#pragma once
#include <optional>
#include <string>
#include <vector>

#include "firmware/metrology/dataset/result.hpp"
#include "firmware/procedure/plan/plan.hpp"
#include "protocol/events/event.hpp"
#include "protocol/units/outcome.hpp"
#include "tools/plan/set_up.hpp"

namespace probebox::plan {

// The uncertainty that a run will have, before anybody measures.
struct Forecast {
  procedure::Method method{};
  ProcedureOptions options;  // as they were chosen; zeros are the method's own
  std::size_t touches{};
  double duration_s{};
  // Keys, shapes and sd (k = 1) as the result's; values are those of the simulation.
  std::vector<metrology::Estimate> estimates;
  std::vector<metrology::Dropped> dropped;  // touches that such a run would leave out, and why
};

// What the box's solver says of simulated runs with this plan: its sd, as the root mean square over some of them. The
// sd of a result is honest, so that it is also what the result will scatter by. Refusal: of the run as it is planned,
// which no such run on a machine would escape; not-forecast for a method that does not touch, or
// whose steps follow from what it reads.
Outcome<Forecast, metrology::Refusal> forecast(procedure::Method method, const ProcedureOptions& options,
                                               const SetUp& set_up);

// Sets that fit into the time, the most precise first: other speeds, repeats, angles or numbers of balls, whatever the
// method leaves open. By the sd of the first component of the method's first estimate. Empty when none fits. Refusal:
// the first one, where every set is refused.
Outcome<std::vector<Forecast>, metrology::Refusal> proposals(procedure::Method method, const ProcedureOptions& options,
                                                             const SetUp& set_up, double time_s);

}  // namespace probebox::plan
