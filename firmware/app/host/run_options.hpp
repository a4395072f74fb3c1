#pragma once
#include "firmware/app/results/reply.hpp"
#include "firmware/box/state.hpp"
#include "firmware/procedure/dataset/run_dataset.hpp"
#include "firmware/procedure/facts/readiness.hpp"
#include "firmware/procedure/plan/plan.hpp"
#include "protocol/messages/control.hpp"
#include "protocol/units/outcome.hpp"

namespace probebox::app {

// What measures the balls of a requested run.
procedure::ReadBy readBy(const messages::StartProcedure::Request& request);

// Completes the options of a run, or returns the reply that refuses it.
Outcome<ProcedureOptions, Reply> plannedOptions(procedure::Method method,
                                                const messages::StartProcedure::Request& request,
                                                const procedure::Facts& facts, const box::State& state);

}  // namespace probebox::app
