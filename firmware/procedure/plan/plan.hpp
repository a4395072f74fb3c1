#pragma once
#include <optional>

#include "firmware/procedure/plan/method.hpp"
#include "firmware/procedure/plan/step.hpp"
#include "protocol/events/event.hpp"
#include "protocol/units/outcome.hpp"

namespace probebox::procedure {

// Names the first invalid option and its valid range; nullopt when the run can be planned. deflection_limit_mm: of the
// probe.
std::optional<Error> whyRefused(Method method, const ProcedureOptions& options, double deflection_limit_mm);

// Fills in the steps of a run, for options that pass whyRefused(). Does not allocate. More loops append steps.
void fill(Plan& plan, Method method, const ProcedureOptions& options, const RimLoops& loops = {});

}  // namespace probebox::procedure
