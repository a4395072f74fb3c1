#pragma once
#include "firmware/app/results/reply.hpp"
#include "firmware/box/state.hpp"
#include "firmware/procedure/plan/readiness.hpp"
#include "protocol/messages/control.hpp"
#include "protocol/units/outcome.hpp"

namespace probebox::app {

// The reply to a run that cannot be started.
Reply refusedFor(const procedure::NotReady& why);
// Completes the options of a run, or returns the reply that refuses it.
Outcome<ProcedureOptions, Reply> plannedOptions(const procedure::LiveMethod& method,
                                                const messages::StartProcedure::Request& request,
                                                const procedure::Facts& facts, const box::State& state);

}  // namespace probebox::app
