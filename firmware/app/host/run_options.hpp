#pragma once
#include "firmware/app/results/reply.hpp"
#include "firmware/box/state.hpp"
#include "firmware/procedure/dataset/run_dataset.hpp"
#include "firmware/procedure/facts/readiness.hpp"
#include "firmware/procedure/plan/plan.hpp"
#include "protocol/messages/control.hpp"
#include "protocol/units/outcome.hpp"

namespace probebox::app {

// What reads the balls of a run that is asked for so.
procedure::ReadBy readBy(const messages::StartProcedure::Request& request);

// The options of a run as it will be planned, or the reply that says why there can be none.
Outcome<ProcedureOptions, Reply> plannedOptions(procedure::Method method,
                                                const messages::StartProcedure::Request& request,
                                                const procedure::Facts& facts, const box::State& state);

}  // namespace probebox::app
