#pragma once
#include <string>

#include "protocol/units/outcome.hpp"
#include "tools/plan/forecast.hpp"
#include "tools/probebox/cli/console.hpp"
#include "tools/probebox/cli/request.hpp"

namespace probebox::command {

// Trouble: more speeds than a run can have.
Outcome<ProcedureOptions, Trouble> optionsOf(const RunChoices& choices);
// A run that no box is asked about. Trouble: no such method, too.
Outcome<plan::Wanted, Trouble> wantedOf(const RunChoices& choices);
// The options of calibrate that make this run.
std::string chosenOf(const plan::Wanted& wanted);

}  // namespace probebox::command
