#pragma once
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "firmware/results/ledger.hpp"
#include "firmware/store/failure.hpp"
#include "protocol/events/event.hpp"
#include "protocol/units/outcome.hpp"

// Which results come into force, wait, are retired or refused: pure functions of the ledger and of the values of
// results.
namespace probebox::results {

using store::Failure;
using store::Record;

// How a result differs from another one about the same subject.
struct Difference {
  bool differs{};                           // by more than a person accepts unasked
  std::string in_words;                     // the values that differ
  std::optional<std::string> less_certain;  // the value whose uncertainty grows most
  bool exceeds_u{};                         // some value has moved by more than its standard uncertainty
};

// What decisions ask about values. Each gives the same answer for the same results.
struct Values {
  Binding here;  // probe, machine and mounting that this box describes; any subject
  std::size_t most_tool_lengths{};
  // Null for a result that is damaged, or that there is not. State and persons are those of the ledger.
  std::function<std::shared_ptr<const Record>(Id)> record;
  // The events that bring a result into force; an error where this box, as it is described, cannot have it.
  std::function<Outcome<std::vector<Event>>(const Record&)> activation;
  // The event by which nothing about the subject is in force; nothing where the core does not follow it.
  std::function<std::optional<Event>(const std::string& subject)> none;
  std::function<Difference(const Record& next, const Record& present)> difference;
  // The turning axis from the spindle's, of one from a tip and the offset of that tip; nothing where they give none.
  std::function<std::optional<metrology::Result>(const Record& from_tip, const Record& offset)> sum;
  // Number of the tool that carries the probe of a centreline from a tip.
  std::function<std::uint32_t(const Record& from_tip)> probe_tool;
};

// Whether a cut is on, or may be: then nothing comes into force or out of it.
struct Cut {
  bool on{};
};

struct Accept {
  Id id{};
  std::string by;
  bool although_it_differs{};
};
// A result that waits, now that the cut is over.
struct Activate {
  Id id{};
};
// Back to the result that was in force before, about the subject of a result in force, or of one that waits, which is
// withdrawn.
struct RollBack {
  Id id{};
  std::string by;
};
struct RollBackSubject {
  Binding binding;
  std::string by;
};
// The sum of a centreline from a tip and the offset of that tip, both in force, that was never made.
struct MakeMissingSum {};
using Command = std::variant<Accept, Activate, RollBack, RollBackSubject, MakeMissingSum>;

struct Decision {
  // In this order. Those of a proposal have the number that the ledger gives next.
  std::optional<store::Proposal> proposal;
  std::vector<Change> changes;
  Id compared_with{};                          // the result that was in force before; 0: none
  std::vector<std::string> notes;              // what a person should know about the effect
  std::vector<std::string> notes_if_it_waits;  // the same where a cut begins before anybody has been told

  bool isEmpty() const { return !proposal && changes.empty(); }
};

// Decides by the ledger alone. Refusals say why, and what to do.
Outcome<Decision, Failure> decide(const Ledger& ledger, const Values& values, const Command& command, const Cut& cut);

// What accept would compare and say; changes nothing.
Outcome<Decision, Failure> compareOnly(const Ledger& ledger, const Values& values, Id id);

// The changes of a decision that are undone where a cut begins before anybody has been told of them, the last one
// first: what came into force waits again, or is retired again, and what left it is in force. A sum whose part waits
// again is only proposed.
std::vector<Change> undoneByCut(const Decision& decision);

// The ledger once the decision is stored.
Ledger after(Ledger ledger, const Decision& decision);

// Events that bring the core from one ledger to the other, in the order of the changes. `errors` gets a sentence for
// each result that does not fit this box, so that none of its subject is in force.
std::vector<Event> eventsBetween(const Ledger& before, const Ledger& now, const Values& values,
                                 std::vector<std::string>& errors);

// The delay of each axis: that of the result which observed it and came into force last. Nothing without any.
std::optional<DelayActivated> delayByAxis(const Ledger& ledger, const Values& values);

// Why this box, as it is described now, cannot have the result in force; nothing for one that is retired.
std::optional<std::string> whyNotHere(const Values& values, const Record& record);

// Whether what rests on a result is to be measured again: it is retired, and the one in its place differs by more than
// its standard uncertainty in some value. A smaller change moves what rests on it by less than its share of that
// uncertainty, which is in the budget.
bool isToRepeat(const Ledger& ledger, const Values& values, Id rested_on);
// One sentence for each result that this one rests on and that isToRepeat() is about.
std::vector<std::string> onRetired(const Ledger& ledger, const Values& values, const Entry& entry);

// The offset in force of the stylus that this tool carries; null without one.
const Entry* stylusOffset(const Ledger& ledger, const Values& values, std::uint32_t probe_tool);

// The refusal of a change that a cut forbids.
Failure cutIsOn();

// "Result 5".
std::string named(Id id);
// "Result 5 about delay waits and ..." of one that does not fit what the box describes now.
std::string waitsUnfit(const Entry& entry, const std::string& why_unfit);
// "Result 5 about check FAILED: ..." or "... is NOT PROVEN: ..." of one that is not proven to be within its limits,
// which a person has to want in force all the same; nothing for others.
std::optional<std::string> whyNotConforming(const Record& record);

}  // namespace probebox::results
