#pragma once
#include "firmware/metrology/dataset/result.hpp"
#include "firmware/procedure/facts/facts.hpp"
#include "protocol/units/outcome.hpp"
#include "tools/plan/wanted.hpp"

namespace probebox::plan {

// The options of a run as the box completes them from its descriptions. Refusal: not-forecast for a method without a
// result; bad-option for one that this run cannot have.
Outcome<ProcedureOptions, metrology::Refusal> completed(const Wanted& wanted, const procedure::Facts& facts);

}  // namespace probebox::plan
