#pragma once
#include <optional>
#include <string>
#include <vector>

#include "firmware/results/values.hpp"

// What a person should know of results.
namespace probebox::results {

// "Result 5 about delay waits and ..." of one that does not fit what the box describes now.
std::string waitsUnfit(const Entry& entry, const std::string& why_unfit);
// "Result 5 about check FAILED: ..." or "... is NOT PROVEN: ..." of one that is not proven to be within its limits,
// which a person has to want in force all the same; nothing for others.
std::optional<std::string> whyNotConforming(const Record& record);

// Of one that comes into force: what rests on it is measured again, what it does, and the warnings that it has.
std::vector<std::string> notesOn(const Ledger& ledger, const Values& values, const Entry& entry, const Record& record);
// Says that a result of a screw has no gain and takes the place of one with a measured gain; nothing for others.
std::optional<std::string> onReplacedGain(const Record& next, const Record& in_force);
// One sentence for each result in force that rests on one about the binding which is retired now.
std::vector<std::string> dependantsOn(const Ledger& now, const Values& values, const Binding& binding);

// Whether what rests on a result is to be measured again: it is retired, and the one in its place differs by more than
// its standard uncertainty in some value. A smaller change moves what rests on it by less than its share of that
// uncertainty, which is in the budget.
bool isToRepeat(const Ledger& ledger, const Values& values, Id rested_on);
// One sentence for each result that this one rests on and that isToRepeat() is about.
std::vector<std::string> onRetired(const Ledger& ledger, const Values& values, const Entry& entry);

}  // namespace probebox::results
