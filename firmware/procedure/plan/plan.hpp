#pragma once
#include <optional>

#include "firmware/procedure/plan/method.hpp"
#include "firmware/procedure/plan/step.hpp"
#include "protocol/events/event.hpp"
#include "protocol/units/outcome.hpp"

namespace probebox::procedure {

// Says which option cannot be used and what could be; nothing when the run can be planned. deflection_limit_mm: of the
// probe.
std::optional<Error> whyRefused(Method method, const ProcedureOptions& options, double deflection_limit_mm);

// The steps of a run, for options that whyRefused() has nothing against. Takes no memory. With more loops there are
// more steps after those that were there.
void fill(Plan& plan, Method method, const ProcedureOptions& options, const RimLoops& loops = {});

}  // namespace probebox::procedure
