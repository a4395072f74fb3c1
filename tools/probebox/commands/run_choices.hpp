#pragma once
#include <string>

#include "protocol/units/outcome.hpp"
#include "tools/plan/forecast.hpp"
#include "tools/probebox/cli/console.hpp"
#include "tools/probebox/cli/request.hpp"

namespace probebox::command {

// Finds the method of a run without asking a box. Trouble: no such method, or more speeds than a run can have.
Outcome<const procedure::LiveMethod*, Trouble> methodOf(const RunChoices& choices);
plan::Wanted wantedOf(const procedure::LiveMethod& method, const RunChoices& choices);
// Returns the options with which `calibrate` makes this run.
std::string chosenOf(const plan::Wanted& wanted);

}  // namespace probebox::command
