#pragma once
#include <optional>
#include <string>
#include <vector>

#include "firmware/app/results/compared_values.hpp"
#include "firmware/store/store.hpp"

// Texts about results that come into force.
namespace probebox::app {

// "Result 5".
std::string named(store::Id id);

// The refusal of a result that differs too much from the one in force. doubt: of whyNotConforming(), or nothing.
store::Failure tooFarApart(const store::Record& record, const Comparison& comparison,
                           const std::optional<std::string>& doubt);

// The refusal of a rollback to a result that does not fit what the box describes now.
store::Failure cannotComeBack(const store::Record& record, const std::string& why_unfit);

// "Result 5 about delay waits and ..." of one that does not fit what the box describes now.
std::string waitsUnfit(const store::Record& record, const std::string& why_unfit);

// "Warning: ..." of each warning that the result was measured or solved with.
std::vector<std::string> warningsOf(const store::Record& record);

// "Result 5 about check FAILED: ..." or "... is NOT PROVEN: ..." of one that is not proven to be within its limits,
// which a person has to want in force all the same; nothing for others.
std::optional<std::string> whyNotConforming(const store::Record& record);
store::Failure notConforming(const store::Record& record, const std::string& why);

// Says that a result of a screw has no gain and takes the place of one with a measured gain; nothing for others.
std::optional<std::string> onReplacedGain(const store::Record& next, const store::Record& in_force);

// Whether what rests on this result is to be measured again: it is retired, and the result in its place differs by more
// than its standard uncertainty in some value. A smaller change moves what rests on it by less than its share of that
// uncertainty, which is in the budget.
bool isToRepeat(store::Store& store, const store::Dependence& other);

// One sentence for each result that this one rests on and that isToRepeat() is about.
std::vector<std::string> onRetired(store::Store& store, const store::Record& record);

}  // namespace probebox::app
