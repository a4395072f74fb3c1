#pragma once
#include <optional>
#include <string>
#include <vector>

#include "firmware/results/values.hpp"

// What the core is told of the results in force.
namespace probebox::results {

// Events that bring the core from one ledger to the other, in the order of the changes. `errors` gets a sentence for
// each result that does not fit this box, so that none of its subject is in force.
std::vector<Event> eventsBetween(const Ledger& before, const Ledger& now, const Values& values,
                                 std::vector<std::string>& errors);

// The delay of each axis: that of the result which observed it and came into force last. Nothing without any.
std::optional<DelayActivated> delayByAxis(const Ledger& ledger, const Values& values);

}  // namespace probebox::results
