#pragma once
#include <string>

#include "protocol/units/outcome.hpp"
#include "tools/plan/forecast.hpp"
#include "tools/probebox/cli/console.hpp"
#include "tools/probebox/cli/request.hpp"

namespace probebox::command {

// Trouble: more speeds than a run can have.
Outcome<ProcedureOptions, Trouble> optionsOf(const RunChoices& choices);
// Finds the method of a run without asking a box. Trouble: no such method, too.
Outcome<plan::Wanted, Trouble> wantedOf(const RunChoices& choices);
// Returns the options with which `calibrate` makes this run.
std::string chosenOf(const plan::Wanted& wanted);

}  // namespace probebox::command
