#pragma once
#include <optional>

#include "firmware/metrology/dataset/result.hpp"
#include "firmware/procedure/facts/facts.hpp"
#include "firmware/procedure/plan/live_method.hpp"
#include "tools/plan/set_up.hpp"

// Assumptions that no run could be made with, named before a solver speaks of touches that nobody has measured.
namespace probebox::plan {

// What a box would refuse the run for at its start: too-few-samples by the rates of its sources, recording-full.
// options: completed; facts: of set_up.
std::optional<metrology::Refusal> whyUnsuited(const procedure::LiveMethod& method, const ProcedureOptions& options,
                                              const procedure::Facts& facts, const SetUp& set_up);

// Explains by the acceleration why a simulated run was refused; nullopt when it reaches its speeds in time.
std::optional<metrology::Refusal> whyTooSluggish(const procedure::LiveMethod& method, const ProcedureOptions& options,
                                                 const SetUp& set_up, const metrology::Refusal& refused);

}  // namespace probebox::plan
