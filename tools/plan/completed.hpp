#pragma once
#include "firmware/metrology/dataset/result.hpp"
#include "firmware/procedure/facts/facts.hpp"
#include "protocol/units/outcome.hpp"
#include "tools/plan/set_up.hpp"
#include "tools/plan/wanted.hpp"

namespace probebox::plan {

// Completes the options of a run as the box does from its descriptions. Refusal: not-forecast for a method without a
// result; bad-option for an option that this run cannot have. deflection_limit_mm: of the probe.
Outcome<ProcedureOptions, metrology::Refusal> completed(const Wanted& wanted, const procedure::Facts& facts,
                                                        double deflection_limit_mm = kAnyLimit_mm);

}  // namespace probebox::plan
